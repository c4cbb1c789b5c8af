"""Speed limits: parameters of the system, within the limits of the robot's build."""

from __future__ import annotations

from dataclasses import replace

import httpx
import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.motion.speed_limits import SpeedLimits
from roboglot.testing import Forward

pytestmark = pytest.mark.world("empty")
PARAMETER = "/api/core/system/v1/parameter"


async def put(client: httpx.AsyncClient, name: str, value: str) -> int:
    return (await client.put(PARAMETER, json={"param": name, "value": value})).status_code


async def test_speed_limit_acts_at_once_until_robot_restarts(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    built = robot[Base].limits.twist
    robot[Driving].drive(Twist(x=1.0), lifetime=60.0)
    await forward(seconds=3)
    assert robot[Base].velocity.x > 0.6
    assert await put(client, "base.max_moving_speed", "0.3") == 200
    assert (await client.get(PARAMETER, params={"param": "base.max_moving_speed"})).json() == "0.300000"
    robot[Driving].drive(Twist(x=1.0), lifetime=60.0)
    await forward(seconds=3)
    assert robot[Base].velocity.x == pytest.approx(0.3, abs=0.02)
    assert await put(client, "base.max_angular_speed", "0.5") == 200
    assert robot[Base].limits.twist == Twist(0.3, built.y, 0.5)
    for nonsense in ("0", "-1", "99", "nan", "fast", "0_0.5", "٠.٣", " 0.3 ", "1e999"):
        assert await put(client, "base.max_moving_speed", nonsense) == 400
    assert await put(client, "base.colour", "1") == 400
    strategy = await client.get(PARAMETER, params={"param": "docking.docked_register_strategy"})
    assert strategy.json() == "when_not_exists"
    robot[Firmware].reboot()
    await forward(seconds=40)
    assert robot[Base].limits.twist == built


async def test_limits_of_robot_connected_later_count(robot: Robot, client: httpx.AsyncClient) -> None:
    base = robot[Base]
    base.built = base.limits = replace(base.limits, twist=Twist(9.0, 0.0, 5.0))  # as its driver sets them
    assert [await put(client, "base.max_moving_speed", text) for text in ("9.5", "8")] == [400, 200]
    assert base.limits.twist == Twist(8.0, 0.0, 5.0)


async def test_second_door_takes_no_limit_for_built(robot: Robot, client: httpx.AsyncClient) -> None:
    full = robot[Base].limits.twist.x
    await put(client, "base.max_moving_speed", "0.3")
    SpeedLimits(robot).start()
    assert await put(client, "base.max_moving_speed", f"{full}") == 200
    assert robot[Base].limits.twist.x == full
