"""Robots are found and mirrored."""

import asyncio
import shlex
from collections.abc import AsyncIterator
from ipaddress import AddressValueError
from pathlib import Path

import pytest

from roboglot.cli import scan
from roboglot.cli.mirror import UNKNOWN, changes, rows
from roboglot.cli.scan import ADDRESSES_MAX, cyberdog_at, expand, slamware_at
from roboglot.config import RobotConfig
from roboglot.drivers.urls import Drivers
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.interaction.light import Colour, Light
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.storage.database import Database
from roboglot.testing import Forward


@pytest.fixture
async def door(robot: Robot, forward: Forward) -> AsyncIterator[SlamwareDoor]:
    made = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await made.start()
    yield made
    await made.close()
    await forward(seconds=1)


def test_networks_are_expanded_within_bounds() -> None:
    assert list(expand(["10.0.0.0/30", "10.0.0.9"])) == ["10.0.0.1", "10.0.0.2", "10.0.0.9"]
    with pytest.raises(ValueError, match=str(ADDRESSES_MAX)):
        list(expand(["10.0.0.0/8"]))
    with pytest.raises((ValueError, AddressValueError)):
        list(expand(["nowhere"]))


def test_scan_prints_a_line_for_the_shell(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    async def find(hosts: list[str], seconds: float) -> AsyncIterator[scan.FoundRobot]:
        yield scan.FoundRobot("cyberdog://10.0.0.9?certs=DIR", "CyberDog 2")

    monkeypatch.setattr(scan, "find", find)
    scan.command(["10.0.0.9"], 0.0)
    robot, _, line = capsys.readouterr().out.strip().splitlines()
    assert shlex.split(robot) == ["cyberdog://10.0.0.9?certs=DIR", "CyberDog", "2"]
    assert "'cyberdog://10.0.0.9?certs=DIR'" in robot
    assert line.endswith("--robot 'b=cyberdog://10.0.0.9?certs=DIR'")


async def test_slamware_robot_is_recognised_and_others_are_not(door: SlamwareDoor, robot: Robot) -> None:
    found = await slamware_at("127.0.0.1", door.port)
    assert found is not None
    assert found.url == f"slamware://127.0.0.1:{door.port}"
    assert robot.description.model in found.words
    assert await cyberdog_at("127.0.0.1", door.port) is None
    server = await asyncio.start_server(lambda _, writer: writer.close(), "127.0.0.1", 0)
    assert await slamware_at("127.0.0.1", server.sockets[0].getsockname()[1]) is None
    server.close()


async def test_a_dog_is_recognised_by_its_certificate(
    robot: Robot, tmp_path: Path, forward: Forward, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scan, "PROBE_SECONDS", 20.0)  # of a busy machine
    door = CyberDogDoor(robot, "127.0.0.1", CyberDogConfig(port=0), tmp_path)
    await door.start()
    try:
        found = await cyberdog_at("127.0.0.1", door.port)
    finally:
        await door.close()
        await forward(seconds=1)
    assert found == scan.FoundRobot(f"cyberdog://127.0.0.1:{door.port}?certs=DIR", "CyberDog 2 CN=cyberdog2.server")


async def test_robomasters_that_broadcast_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    async def discover(seconds: float) -> list[str]:
        return ["10.0.0.5"]

    monkeypatch.setattr(scan, "discover", discover)
    assert [robot.url async for robot in scan.find([], 0.0)] == ["robomaster://10.0.0.5"]


async def test_mirror_shows_the_robots_reports(door: SlamwareDoor, clock: LockstepClock, forward: Forward) -> None:
    database = Database(":memory:")
    robots = [RobotConfig("b", f"slamware://127.0.0.1:{door.port}")]
    fleet = build_fleet("empty", robots, clock=clock, seed=1, database=database)
    shown = dict(rows(fleet.robots["b"]))
    assert shown == {"robot": "?", "link": "connecting", "last news": "never"}
    await fleet.start(wait=True)
    await forward(seconds=1)
    shown = dict(rows(fleet.robots["b"]))
    assert shown["link"] == "up"
    assert shown["battery"].startswith("90%")
    assert shown["by odometry"].startswith("x +0.00 m")
    shown = {}
    assert {"link", "battery", "by odometry"} <= dict(changes(fleet.robots["b"], shown)).keys()
    assert dict(changes(fleet.robots["b"], shown)).keys() <= {"scan"}  # of a robot at rest
    await door.close()
    await forward(seconds=2)
    assert dict(changes(fleet.robots["b"], shown))["link"].startswith("lost")
    await fleet.close()
    database.close()


async def test_a_mirror_changes_nothing(
    door: SlamwareDoor, robot: Robot, clock: LockstepClock, forward: Forward
) -> None:
    robot[Light].shine("left", Colour(1, 2, 3))
    mirrored, drivers = Robot("mirrored", UNKNOWN, clock), Drivers(touches=False)
    drivers.add(mirrored, f"slamware://127.0.0.1:{door.port}")
    (driver,) = drivers.all
    await driver.start(wait=True)
    await forward(seconds=3)
    assert dict(rows(mirrored))["link"] == "up"
    assert robot[Light].state("left").colour == Colour(1, 2, 3)
    assert Light not in mirrored
    await driver.close()
