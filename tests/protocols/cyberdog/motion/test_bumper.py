"""Contacts during motion, as an app sees them."""

from __future__ import annotations

import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.geometry import Pose
from roboglot.wire.cyberdog.chapters.motion.motion import MotionCode
from tests.protocols.cyberdog.phone import Stream, localized, until

pytestmark = pytest.mark.world("empty")
WALK = {"motion_id": 303, "cmd_type": 1, "cmd_source": 0, "vel_des": [0.5, 0, 0]}
LOW = (0.3, 3.0, 0.08)  # m; invisible to lidar and depth camera


async def test_a_navigation_that_bumps_fails_with_304(client, robot, world, forward, passing) -> None:
    await forward(seconds=1)
    await localized(client, passing)
    world.stage.add_obstacle(Pose(2.0, 5.0), LOW)
    stream = Stream(client, 6004, {"type": 1, "goalX": 4.0, "goalY": 0.0})
    await passing(lambda: stream.ended)
    assert stream.codes[-1] == 304
    assert stream.answers[-1] == {"result": 3}
    assert robot[Base].velocity.speed == 0.0


async def test_servo_frames_into_a_wall_are_refused(client, app, robot, world, forward, passing) -> None:
    world.stage.place("a", Pose(9.5, 5.0, 0.0))
    await client.ask(10001)
    await passing(lambda: app.connected)
    for _ in range(20):
        await client.ask(1002, WALK)
        await forward(seconds=0.1)
    assert robot[Base].velocity.speed == 0.0
    assert world.truth.pose_of("a").x == pytest.approx(9.75, abs=0.01)
    await until(lambda: any(frame["code"] == MotionCode.STUCK for frame in app.of(1003)))
    assert await client.ask(1002, {**WALK, "vel_des": [-0.5, 0, 0]}) == ""
    await forward(seconds=0.3)
    assert world.truth.pose_of("a").x < 9.74
