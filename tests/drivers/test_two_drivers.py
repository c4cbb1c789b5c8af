"""Two drivers in a row: a robot behind a driver, whose own door is the robot of another driver."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward, assert_pose
from tests.drivers.clients import Drive, served
from tests.drivers.rig import time_passes

VENDORS = "slamware", "robomaster", "cyberdog"
CELLS = [*product(VENDORS, VENDORS)]
# A Slamware robot is driven by pulses, whose delay the second driver does not know unless it sends such pulses itself.
SETTLES = {(near, far) for near, far in CELLS if near != "slamware" or far == near}


@pytest.mark.slow  # in short: test_a_cell
@pytest.mark.world("office")
@pytest.mark.parametrize(("near", "far"), CELLS)
async def test_a_driven_robot_is_driven_again(
    near: str, far: str, drive: Drive, robot: Robot, world: World, forward: Forward, tmp_path: Path
) -> None:
    async with (
        time_passes(forward, threads=True),
        served(near, robot, tmp_path / "near") as url,
    ):
        await robot.clock.sleep(2.0)
        middle = await drive(url)
        await robot.clock.sleep(3.0)
        async with served(far, middle, tmp_path / "far") as door:
            driven = await drive(door + ("&drive=speed" if (near, far) == ("slamware", "robomaster") else ""))
            await robot.clock.sleep(3.0)
            assert (middle[Link].state, driven[Link].state) == (LinkState.UP, LinkState.UP)
            assert driven[Battery].state.percentage == pytest.approx(robot[Battery].state.percentage, abs=0.02)
            start, odometry = world.truth.pose_of("a"), driven[Odometry].reading.pose
            if (near, far) in SETTLES:
                await driven[Driving].move_by(Pose(0.4, 0.0, 0.0)).succeeded()
                assert_pose(world.truth.pose_of("a").relative_to(start), x=0.4, y=0.0, within=0.1)
            turn = driven[Driving].drive(Twist(0.0, 0.0, 0.5), lifetime=1.0)
            assert await turn.done() is ActionStatus.SUCCEEDED
            action = driven[Driving].drive(Twist(0.2, 0.0, 0.0), lifetime=1.0)
            assert await action.done() is ActionStatus.SUCCEEDED
            await robot.clock.sleep(1.0)
            moved = world.truth.pose_of("a").relative_to(start)
            assert 0.2 < moved.yaw < 0.8
            assert moved.x > 0.1
            assert driven[Odometry].reading.pose.yaw - odometry.yaw == pytest.approx(moved.yaw, abs=0.1)
            before = world.truth.pose_of("a")
            await robot.clock.sleep(0.5)
            assert world.truth.pose_of("a").distance_to(before) < 0.02
