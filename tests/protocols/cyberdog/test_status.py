"""Status 10001: charging and failures."""

from __future__ import annotations

import json
from typing import Any

import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.components.energy.battery import SimulatedBattery
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.protocols.cyberdog.phone import Client


@pytest.fixture
def robot(walker: tuple[World, Robot]) -> Robot:
    return walker[1]


async def self_check(client: Client) -> tuple[int, Any]:
    status = (await client.ask(10001))["self_check_status"]
    return status["code"], json.loads(status["description"])


async def charging(client: Client) -> tuple[bool, bool]:
    status = (await client.ask(10001))["charging_status"]
    return status["wired_charging"], status["wireless_charging"]


async def test_charging_by_dock_and_by_wire_differ(client, robot, walker, forward: Forward) -> None:
    await forward(seconds=1)
    assert await charging(client) == (False, True)
    walker[0].stage.place("a", Pose(6.0, 10.0))
    await forward(seconds=2)
    assert await charging(client) == (False, False)
    battery = robot[Battery]
    assert isinstance(battery, SimulatedBattery)
    battery.plug(True)
    await forward(seconds=1)
    assert await charging(client) == (True, False)


async def test_the_self_check_waits_for_the_first_scan(client, forward: Forward) -> None:
    assert await self_check(client) == (1, {"motion_manager": 0, "device": {"bms": 0}, "sensor": {"lidar": -1}})
    await forward(seconds=1)
    assert await self_check(client) == (0, {"motion_manager": 0, "device": {"bms": 0}, "sensor": {"lidar": 0}})


@pytest.mark.parametrize(
    ("part", "level", "code", "expected"),
    [
        ("lidar", FaultLevel.FATAL, 4, {"sensor": {"lidar": 2109}}),
        ("bumper", FaultLevel.ERROR, 4, {"sensor": {"lidar": 0, "others": 1}}),
        ("disk", FaultLevel.ERROR, 4, {"device": {"bms": 0, "others": 1}}),
        ("battery", FaultLevel.ERROR, 2, {"device": {"bms": 1409}}),
        ("base", FaultLevel.ERROR, 2, {"motion_manager": 1}),
        ("battery", FaultLevel.WARNING, 0, {}),
    ],
)
async def test_self_check_reports_every_failed_part(client, robot, forward, part, level, code, expected) -> None:
    await forward(seconds=1)
    robot[Health].set("broken for the test", True, part, level)
    well = {"motion_manager": 0, "device": {"bms": 0}, "sensor": {"lidar": 0}}
    assert await self_check(client) == (code, {**well, **expected})
    robot[Health].set("broken for the test", False, part, level)
    assert await self_check(client) == (0, well)
