"""A short move that takes over from the same client's: no stop between, and never a robot that nothing stops."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest

from roboglot.autonomy.navigation.driving import OdometryDriving
from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward, assert_pose

pytestmark = pytest.mark.world("empty", body="robomaster_ep")
SPEED = 0.4  # m/s


async def under_way(robot: Robot, forward: Forward) -> None:
    robot[Driving].move_by(Pose(1.0), speed=SPEED, source="one")
    await forward(seconds=0.6)
    assert robot[Base].velocity.x > 0.9 * SPEED


async def test_renewed_moves_go_on_without_a_stop(robot: Robot, world: World, forward: Forward) -> None:
    await under_way(robot, forward)
    start, speeds = world.truth.pose_of("a"), []
    for _ in range(20):
        action = robot[Driving].move_by(Pose(0.12), speed=SPEED, source="one")
        await forward(seconds=0.1)
        speeds.append(robot[Base].velocity.x)
    assert min(speeds) > 0.9 * SPEED
    assert world.truth.pose_of("a").distance_to(start) == pytest.approx(20 * 0.1 * SPEED, rel=0.05)
    await forward(seconds=2)
    assert action.status is ActionStatus.SUCCEEDED
    assert robot[Base].velocity.speed < 0.01
    assert [each.status for each in robot.actions.history[:-1]] == [ActionStatus.CANCELED] * 19


async def test_a_turn_is_renewed_too(robot: Robot, world: World, forward: Forward) -> None:
    start = world.truth.pose_of("a")
    for _ in range(30):
        robot[Driving].move_by(Pose(0.12, yaw=0.3), speed=SPEED, yaw_speed=1.0, source="one")
        await forward(seconds=0.1)
        left = robot[Base].velocity
    assert (left.x, left.yaw) == (pytest.approx(SPEED, abs=0.06), pytest.approx(1.0, abs=0.15))
    assert world.truth.pose_of("a").relative_to(start).yaw == pytest.approx(3.0, abs=0.3)


async def test_another_client_waits_until_the_robot_stands(robot: Robot, forward: Forward) -> None:
    await under_way(robot, forward)
    robot[Driving].move_by(Pose(-0.2), speed=SPEED, source="two")
    await forward(seconds=0.05)
    assert robot[Base].velocity.x < 0.8 * SPEED


async def test_a_way_back_begins_after_braking(robot: Robot, forward: Forward) -> None:
    await under_way(robot, forward)
    measured = robot[Odometry].reading.pose
    action = robot[Driving].move_by(Pose(-0.3, 0.2, 0.5), speed=SPEED, source="one")
    await forward(seconds=4)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    there = robot[Odometry].reading.pose.relative_to(measured)  # less the braking distance
    assert_pose(there, x=-0.28, y=0.2, deg=28.6, within=0.03)


@pytest.mark.parametrize("ticks", range(8))
async def test_cancelled_between_two_moves_it_stands(robot: Robot, forward: Forward, ticks: int) -> None:
    await under_way(robot, forward)
    action = robot[Driving].move_by(Pose(0.5), speed=SPEED, source="one")
    for _ in range(ticks):
        await asyncio.sleep(0)
    action.cancel("its client is gone")
    await forward(seconds=0.6)
    assert robot[Base].velocity.speed < 0.01
    assert robot.actions.running() == []


@pytest.mark.parametrize("ticks", range(8))
async def test_many_at_once_and_a_stop_end_standing(robot: Robot, forward: Forward, ticks: int) -> None:
    await under_way(robot, forward)
    actions = [robot[Driving].move_by(Pose(0.5), speed=SPEED, source="one") for _ in range(3)]
    for _ in range(ticks):
        await asyncio.sleep(0)
    for action in actions:
        action.cancel()
    await forward(seconds=0.6)
    assert robot[Base].velocity.speed < 0.01
    assert all(later.status is ActionStatus.CANCELED for _, later in pairwise(actions))


async def test_a_velocity_after_renewed_moves_is_kept(robot: Robot, forward: Forward) -> None:
    await under_way(robot, forward)
    robot[Driving].move_by(Pose(0.5), speed=SPEED, source="one")
    robot[Driving].drive(Twist(x=0.2), source="one")
    await forward(seconds=1)
    assert robot[Base].velocity.x == pytest.approx(0.2, abs=0.03)
    assert isinstance(robot[Driving], OdometryDriving)


@pytest.mark.world("empty", body="hermes")
async def test_velocity_while_braking_at_wall_ends_in_time(robot: Robot, world: World, forward: Forward) -> None:
    world.stage.place("a", Pose(8.2, 6.0))
    await forward(seconds=1)
    drive, ahead = robot[Driving].drive, Twist(x=0.5, yaw=-0.2)
    first = drive(ahead, source="one")
    while robot[Base].hindrance(ahead) is None:
        await forward(seconds=0.02)
    await forward(seconds=0.04)
    assert first.status is ActionStatus.EXECUTING  # the emergency brake has stopped it, and it turns for a moment
    second = drive(Twist(yaw=0.8), lifetime=0.3, source="one")
    await forward(seconds=2)
    assert first.status.ended
    assert second.status is ActionStatus.SUCCEEDED
    assert robot[Base].velocity == Twist()
