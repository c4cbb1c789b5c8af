"""Robots that are shoved say so, stop until they know where they are, and succeed nowhere else. Judged by the world."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.errors import Blocked, NotLocalized
from roboglot.model.events import PoseConfirmed, RobotDisplaced
from roboglot.model.geometry import Pose, Vector3

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour

SIDEWAYS, HARD = Vector3(0.0, 40.0, 0.0), Vector3(0.0, 120.0, 0.0)  # N s, on 20 and 60 kg


@pytest.mark.world("office", body="hermes")
async def test_shoved_standing_robot_reports_it(tour: Tour) -> None:
    await tour.go((20.0, 10.0))
    shoves, confirmed = tour.robot.events.subscribe(RobotDisplaced), tour.robot.events.subscribe(PoseConfirmed)
    await tour.clock.advance(3.0)
    assert not shoves.drain()
    before = tour.truth
    tour.world.stage.push("a", HARD)
    worst = 1.0
    for _ in range(20):
        await tour.clock.advance(0.1)
        worst = min(worst, tour.robot[Localization].quality)
    (shove,) = shoves.drain()
    assert tour.truth.distance_to(before) > 0.08
    assert shove.distance == pytest.approx(tour.truth.distance_to(before), abs=0.03)
    assert worst < 0.5
    assert len(confirmed.drain()) == 1
    assert tour.error[0] < 0.04


@pytest.mark.slow  # in short: test_shoved_standing_robot_reports_it
@pytest.mark.world("office")
async def test_robot_shoved_while_driving_waits_until_localized(tour: Tour) -> None:
    await tour.go((20.0, 10.0))
    shoves = tour.robot.events.subscribe(RobotDisplaced)
    action = tour.head_for((12.0, 10.0))
    await tour.until(lambda: tour.robot[Base].velocity.speed > 0.8)
    await tour.clock.advance(1.0)
    assert not shoves.drain()
    tour.world.stage.push("a", SIDEWAYS)
    await tour.until(lambda: bool(shoves.drain()), seconds=2.0)
    slowest = 9.0
    for _ in range(10):
        await tour.clock.advance(0.1)
        slowest = min(slowest, tour.robot[Base].velocity.speed)
    assert slowest < 0.4
    await tour.end_of(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.truth.distance_to(Pose(12.0, 10.0)) < 0.1


@pytest.mark.world("office")
async def test_move_with_a_shove_does_not_succeed(tour: Tour) -> None:
    await tour.go((20.0, 10.0))
    action = tour.robot[Driving].move_by(Pose(2.0), speed=0.8)
    await tour.clock.advance(1.2)
    tour.world.stage.push("a", SIDEWAYS)
    await tour.end_of(action)
    assert isinstance(action.error, Blocked)
    assert "displaced" in action.reason


@pytest.mark.world("office", body="hermes")
@pytest.mark.parametrize(("speed", "blow"), [(0.6, 120.0), pytest.param(0.2, 90.0, marks=pytest.mark.slow)])
async def test_push_against_the_wheels_is_no_slip(tour: Tour, speed: float, blow: float) -> None:
    """The robot fell short of its wheels' way, and was then lost beside its place."""
    await tour.go((20.0, 10.0), deg=180)
    shoves, action = tour.robot.events.subscribe(RobotDisplaced), tour.robot[Driving].move_by(Pose(2.0), speed=speed)
    await tour.clock.advance(1.5)
    tour.world.stage.push("a", Vector3(-blow, 0.0, 0.0))
    await tour.end_of(action)
    assert len(shoves.drain()) == 1
    assert isinstance(action.error, Blocked)
    assert "displaced" in action.reason
    assert tour.error[0] < 0.05


@pytest.mark.world("office")
@pytest.mark.parametrize("carried", [Pose(0.0, 0.0, 0.6), Pose(0.0, -2.0, 1.5)], ids=["turned", "far"])
async def test_move_of_a_carried_robot_does_not_succeed(tour: Tour, carried: Pose) -> None:
    await tour.clock.advance(3.0)
    action = tour.robot[Driving].move_by(Pose(2.0), speed=0.4)
    await tour.clock.advance(1.5)
    pose = tour.truth
    tour.world.stage.place("a", Pose(pose.x + carried.x, pose.y + carried.y, pose.yaw + carried.yaw))
    await tour.end_of(action)
    assert isinstance(action.error, NotLocalized), action.reason


CARRIED = {
    "aside": Pose(0.0, -1.0),
    "far": Pose(0.0, -2.0, 1.5),
    "turned": Pose(0.0, 0.0, 0.6),
    "little": Pose(0.2, 0.2),
}


@pytest.mark.world("office")
@pytest.mark.parametrize(
    "carried",
    [
        *(pytest.param(CARRIED[name], id=name) for name in ("aside", "little")),
        *(pytest.param(CARRIED[name], id=name, marks=pytest.mark.slow) for name in ("turned", "far")),
    ],
)
@pytest.mark.parametrize("before", [0.06, *(pytest.param(before, marks=pytest.mark.slow) for before in (0.3, 1.0))])
async def test_move_with_a_carry_at_its_end_fails(tour: Tour, carried: Pose, before: float) -> None:
    await tour.go((20.0, 10.0), deg=180)
    goal = tour.truth.compose(Pose(1.0))
    action = tour.robot[Driving].move_by(Pose(1.0), speed=0.6)
    await tour.clock.advance(2.13 - before)  # as long as it takes
    pose = tour.truth
    tour.world.stage.place("a", Pose(pose.x + carried.x, pose.y + carried.y, pose.yaw + carried.yaw))
    begun = tour.clock.time()
    await tour.end_of(action)
    assert begun + before - 0.1 < tour.clock.time() < begun + before + 4.0
    assert tour.truth.distance_to(goal) > 0.08 or abs(tour.truth.yaw - goal.yaw) > 0.1
    assert isinstance(action.error, NotLocalized | Blocked), action.reason


@pytest.mark.world("office")
async def test_move_on_its_own_ends_soon(tour: Tour) -> None:
    await tour.go((20.0, 10.0), deg=180)
    action, begun = tour.robot[Driving].move_by(Pose(1.0), speed=0.6), tour.clock.time()
    await tour.end_of(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.clock.time() - begun < 2.5


@pytest.mark.world("office")
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
async def test_driving_and_turning_are_no_shoves(tour: Tour, seed: int) -> None:
    shoves = tour.robot.events.subscribe(RobotDisplaced)
    for spot in ((20.0, 10.0), (12.0, 10.0 + seed), (20.0, 10.0)):
        assert (await tour.go(spot)).status is ActionStatus.SUCCEEDED
    await tour.end_of(tour.robot[Driving].move_by(Pose(1.0, 0.5, 3.0)))
    assert not shoves.drain()


@pytest.mark.slow  # long; in short: test_driving_and_turning_are_no_shoves
@pytest.mark.world("obstacle_course")
async def test_slipping_wheels_are_no_displacement(tour: Tour) -> None:
    """Against the side of a ramp, which the lidar does not see."""
    tour.world.stage.place("a", Pose(3.9, 2.9, math.pi / 2))
    tour.robot[Localization].set_pose(tour.truth.relative_to(tour.start))
    await tour.clock.advance(3.0)
    shoves = tour.robot.events.subscribe(RobotDisplaced)
    action = await tour.end_of(tour.robot[Driving].move_by(Pose(2.0), speed=0.4))
    assert tour.truth.y < 3.2
    assert isinstance(action.error, Blocked)
    assert not shoves.drain()
    assert tour.error[0] < 0.05
