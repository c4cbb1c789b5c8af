"""URLs of real robots, and the refusals of others."""

from collections.abc import Collection
from pathlib import Path

import pytest

from roboglot.config import RobotConfig, load_config, parse_robot
from roboglot.drivers.urls import Drivers
from roboglot.fleet import UNKNOWN
from roboglot.model.clock import LockstepClock
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.errors import Unconnected
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.protocols.slamware.chapters.system.system import device_id
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.testing import Forward
from tests.drivers.settling import settle


def test_a_robot_is_given_by_body_or_url() -> None:
    assert parse_robot("b=slamware://192.168.11.1:1448") == RobotConfig("b", "slamware://192.168.11.1:1448", "")
    assert parse_robot("b=robomaster://discover@127.0.0.9") == RobotConfig("b", "robomaster://discover", "127.0.0.9")
    assert parse_robot("b=slamware://h").is_real
    assert not parse_robot("b=hermes").is_real


def test_one_owner_for_each_connection() -> None:
    robots = [{"name": name, "body": "slamware://192.168.11.1"} for name in "ab"]
    with pytest.raises(ValueError, match="two robots have the URL"):
        load_config(None, {"robots": robots})


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("ftp://host", "there are drivers for slamware"),
        ("slamware://", "SCHEME://HOST:PORT"),
        ("slamware://host:99999", "Port"),
        ("slamware://host/path", "SCHEME://HOST:PORT"),
        ("slamware://host?certs=x", "unknown options: certs"),
        ("robomaster://host?event=x", "event is a port"),
        ("robomaster://host?colour=red", "unknown options: colour"),
        ("cyberdog://host", "requires certificates"),
        ("cyberdog://host?certs=x&app=y", "app is a port"),
    ],
)
def test_other_urls_are_refused_in_plain_words(url: str, words: str, clock: LockstepClock) -> None:
    with pytest.raises(ValueError, match=words):
        Drivers().add(Robot("b", UNKNOWN, clock), url)


@pytest.mark.parametrize(
    "url", ["slamware://127.0.0.1:1", "robomaster://127.0.0.1:1", "cyberdog://127.0.0.1:1?certs=none&app=0"]
)
async def test_every_door_opens_for_an_absent_robot(
    url: str, clock: LockstepClock, forward: Forward, tmp_path: Path
) -> None:
    from roboglot.fleet import build_fleet
    from roboglot.storage.database import Database

    database = Database(":memory:")
    fleet = build_fleet("empty", [RobotConfig("b", url)], clock=clock, seed=1, database=database)
    await fleet.start(wait=False)
    robot = fleet.robots["b"]
    ports = RoboMasterConfig(control_port=0, event_port=0, video_port=0, audio_port=0)
    doors = (
        SlamwareDoor(robot, "127.0.0.81", SlamwareConfig(port=0)),
        RoboMasterDoor(robot, "127.0.0.81", ports),
        CyberDogDoor(robot, "127.0.0.81", CyberDogConfig(port=0), tmp_path),
    )
    for door in doors:
        await door.start()
    for _ in range(20):
        await forward(seconds=0.1)
        await settle()
    assert robot[Link].state is LinkState.CONNECTING
    with pytest.raises(Unconnected):  # clients would remember an invented number
        device_id(robot)
    for door in doors:
        await door.close()
    await fleet.close()
    database.close()


def test_robots_without_a_serial_number_differ(clock: LockstepClock) -> None:
    assert device_id(Robot("a", UNKNOWN, clock)) != device_id(Robot("b", UNKNOWN, clock))


async def test_own_doors_are_not_discovered_as_robots(clock: LockstepClock, monkeypatch: pytest.MonkeyPatch) -> None:
    from roboglot.fleet import build_fleet
    from roboglot.storage.database import Database

    passed_over: set[str] = set()

    async def discover(seconds: float, *, passing_over: Collection[str], **_: object) -> list[str]:
        passed_over.update(passing_over)
        return []

    monkeypatch.setattr("roboglot.drivers.robomaster.driver.discover", discover)
    database = Database(":memory:")
    robots = [RobotConfig("a", "universal", "127.0.0.81"), RobotConfig("b", "robomaster://discover", "127.0.0.82")]
    fleet = build_fleet("empty", robots, clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    assert passed_over == {"127.0.0.81", "127.0.0.82"}  # its own above all: it would drive itself
    assert fleet.robots["b"][Link].reason == "no free RoboMaster broadcasts here"
    await fleet.close()
    database.close()
