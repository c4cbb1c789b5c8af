"""A robot without a lidar feels when something else than its wheels moves it. Judged by the world."""

from __future__ import annotations

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.errors import Blocked
from roboglot.model.events import RobotDisplaced
from roboglot.model.geometry import Pose, Twist, Vector3
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World

MIDDLE = Pose(5.0, 5.0)
SOFT, HARD, SIDEWAYS = Vector3(1.0, 0.0, 0.0), Vector3(6.0, 0.0, 0.0), Vector3(0.0, 6.0, 0.0)  # N s, on 3.4 kg

pytestmark = pytest.mark.world("empty", body="robomaster_ep")


@pytest.fixture(autouse=True)
async def in_the_middle(world: World, clock: LockstepClock) -> None:
    """Away from all walls."""
    world.stage.place("a", MIDDLE)
    await clock.advance(1.0)


@pytest.mark.parametrize("blow", [HARD, SIDEWAYS])
async def test_a_shove_is_reported_with_its_way(
    robot: Robot, world: World, clock: LockstepClock, blow: Vector3
) -> None:
    shoves, before = robot.events.subscribe(RobotDisplaced), world.truth.pose_of("a")
    world.stage.push("a", blow)
    await clock.advance(2.0)
    (shove,) = shoves.drain()
    way = world.truth.pose_of("a").distance_to(before)
    assert way > 0.1
    assert shove.distance == pytest.approx(way, rel=0.4)


async def test_a_nudge_is_not_reported(robot: Robot, world: World, clock: LockstepClock) -> None:
    shoves, before = robot.events.subscribe(RobotDisplaced), world.truth.pose_of("a")
    world.stage.push("a", SOFT)
    await clock.advance(2.0)
    assert world.truth.pose_of("a").distance_to(before) < 0.05
    assert not shoves.drain()


async def test_a_shoved_move_does_not_succeed(robot: Robot, world: World, clock: LockstepClock) -> None:
    action = robot[Driving].move_by(Pose(1.0), speed=0.5)
    await clock.advance(1.0)
    world.stage.push("a", SIDEWAYS)
    await clock.advance(5.0)
    assert action.status is not ActionStatus.SUCCEEDED
    assert isinstance(action.error, Blocked)
    assert "displaced" in action.reason


@pytest.mark.parametrize(
    "seed", [pytest.param(s, marks=pytest.mark.world("empty", body="robomaster_ep", seed=s)) for s in (1, 2, 3)]
)
async def test_driving_hard_is_no_shove(robot: Robot, world: World, clock: LockstepClock, seed: int) -> None:
    shoves = robot.events.subscribe(RobotDisplaced)
    for twist in (Twist(3.5), Twist(-3.5), Twist(0.0, 3.0), Twist(2.0, 1.0, 3.0), Twist(0.0, 0.0, 8.0)):
        world.stage.place("a", MIDDLE)
        await clock.advance(0.1)
        robot[Base].set_velocity(twist)
        await clock.advance(0.8)
        robot[Base].set_velocity(Twist())
        await clock.advance(1.5)
    assert not shoves.drain(), seed


async def test_running_into_a_wall_is_no_shove(robot: Robot, clock: LockstepClock) -> None:
    shoves = robot.events.subscribe(RobotDisplaced)
    robot[Base].set_velocity(Twist(2.0))
    await clock.advance(4.0)
    robot[Base].set_velocity(Twist())
    await clock.advance(1.0)
    assert not shoves.drain()
