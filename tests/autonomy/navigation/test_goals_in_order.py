"""Several goals: who says that it was at all of them in turn, was; by the truth, on every body that navigates."""

from __future__ import annotations

import math
import random
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from roboglot.autonomy.navigation.follower import PERIOD, Follower
from roboglot.autonomy.navigation.route import Route
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.motion.base import BaseLimits
from roboglot.model.components.motion.navigation import Navigation, NavigationFeedback, NavigationOptions
from roboglot.model.errors import Blocked
from roboglot.model.events import ActionChanged
from roboglot.model.geometry import Point, Pose, Twist
from roboglot.testing import passed_in_order
from tests.narrowing import of_kind

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour

BODIES = ("hermes", "universal", "cyberdog2")  # robomaster_ep has no lidar, hence no navigation
TOLERANCE, LOCALIZATION = 0.1, 0.03  # m: requested precision, and the error of localization
SPOTS = ((2.0, 1.0), (2.0, 3.0), (4.0, 3.0), (4.0, 1.0), (2.1, 1.0), (3.0, 2.0))
THERE_AND_BACK = [(1.2, 1.8), (1.2, 0.3), (1.2, 1.8)]


def hard_lists(seed: int) -> list[tuple[float, float]]:
    """Goals (m) of a list that crosses and retraces itself, with neighbours that are the same and nearly the same."""
    draw = random.Random(seed)
    spots = [(draw.uniform(1.0, 5.0), draw.uniform(-2.5, 2.5)) for _ in range(3)]
    x, y = spots[0]
    spots += [spots[0], spots[2], spots[1], spots[1], (x + 0.06, y), (x, y)]
    return draw.sample(spots, 3) + draw.sample(spots, 4)


goals = st.lists(
    st.one_of(
        st.sampled_from(SPOTS),
        st.tuples(st.integers(0, 40), st.integers(0, 40)).map(lambda cell: (cell[0] / 10, cell[1] / 10)),
    ),
    min_size=1,
    max_size=8,
)


@given(spots=goals, holonomic=st.booleans(), tolerance=st.sampled_from((0.05, 0.1)))
@example(spots=THERE_AND_BACK, holonomic=False, tolerance=0.05)
@example(spots=[(1.0, 0.0), (0.9, 0.0), (1.0, 0.0), (0.9, 0.0)], holonomic=False, tolerance=0.1)
@example(spots=[(2.0 + 0.02 * k, 2.0) for k in range(100)], holonomic=True, tolerance=0.1)
@settings(max_examples=60)
def test_a_follower_passes_all_goals_in_order(
    spots: list[tuple[float, float]], holonomic: bool, tolerance: float
) -> None:
    """Simulate in the plane, on ideal wheels within their limits; straight lines from goal to goal."""
    limits = BaseLimits(
        twist=Twist(1.2, 1.2 * holonomic, 1.8), linear_acceleration=0.8, angular_acceleration=3.0, holonomic=holonomic
    )
    wanted = [Point(*spot) for spot in spots]
    legs = [np.array([a, b])[int(number > 0) :] for number, (a, b) in enumerate(pairwise([(0.0, 0.0), *spots]))]
    route = Route(legs, wanted, tolerance)
    route.set_speeds(np.full(len(route.points), 1.2), limits.linear_acceleration)
    follower, pose, speed, track = Follower(limits, 1.2, route), Pose(), Twist(), [Pose()]
    for _ in range(10_000):
        follower.locate(pose)
        if follower.last and pose.distance_to(follower.end) < 0.02:
            break
        speed = _reached(speed, follower.command(pose), limits)
        pose = pose.compose(Pose(speed.x * PERIOD, speed.y * PERIOD, speed.yaw * PERIOD))
        track.append(pose)
    else:
        pytest.fail(f"not there after {len(track) * PERIOD:.0f} s")
    assert passed_in_order([track[0], *track], wanted, tolerance) == len(wanted)


def _reached(now: Twist, asked: Twist, limits: BaseLimits) -> Twist:
    """Return the velocity a period later."""
    by, turn_by = limits.linear_acceleration * PERIOD, limits.angular_acceleration * PERIOD
    dx, dy = asked.x - now.x, asked.y - now.y
    share = min(1.0, by / max(math.hypot(dx, dy), 1e-9))
    turn = max(-turn_by, min(turn_by, asked.yaw - now.yaw))
    return Twist(now.x + share * dx, now.y + share * dy, now.yaw + turn)


@pytest.mark.parametrize(
    "spots",
    [THERE_AND_BACK, *(pytest.param(hard_lists(seed), marks=pytest.mark.slow) for seed in (1, 2))],
    ids=["and back", "1", "2"],
)
@pytest.mark.parametrize(
    "body",
    [
        pytest.param(
            body,
            id=body,
            marks=[pytest.mark.world("empty", body=body), *([pytest.mark.slow] if body != "universal" else [])],
        )
        for body in BODIES
    ],
)
async def test_success_means_every_goal_was_reached(tour: Tour, body: str, spots: list[tuple[float, float]]) -> None:
    wanted = [Point(*spot) for spot in spots]
    left: list[int] = []
    tour.robot.events.listen(ActionChanged, lambda event: left.append(_milestones(event.action)))
    action = tour.robot[Navigation].navigate_to(wanted, NavigationOptions(tolerance=TOLERANCE))
    track = [tour.truth.relative_to(tour.start)]
    while not action.status.ended:
        await tour.clock.advance(0.04)
        track.append(tour.truth.relative_to(tour.start))
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert passed_in_order(track, wanted, TOLERANCE + LOCALIZATION) == len(wanted)
    reported = [number for number in left if number >= 0]
    assert {before - after for before, after in pairwise(reported)} <= {0, 1}  # they count down one by one
    assert (reported[0], reported[-1]) == (len(wanted), 1)
    assert not tour.bumps


def _milestones(action: Action) -> int:
    return len(action.feedback.milestones) if isinstance(action.feedback, NavigationFeedback) else -1


@pytest.mark.slow
@pytest.mark.world("tests/autonomy/worlds/corridor.toml")
async def test_second_try_continues_at_the_next_goal(tour: Tour) -> None:
    action = tour.head_for((3.0, 1.2), (8.5, 1.2), retries=3)
    await tour.until(lambda: tour.truth.x > 3.5)
    wall = tour.world.stage.add_obstacle(Pose(5.5, 1.2, 0.0), (0.3, 2.3, 1.0))
    west = tour.truth.x
    for _ in range(450):
        await tour.clock.advance(0.1)
        west = min(west, tour.truth.x)
    assert len(of_kind(action.feedback, NavigationFeedback).milestones) == 1
    tour.world.stage.remove_obstacle(wall)
    await tour.end_of(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert west > 3.3


@pytest.mark.slow  # a long story
@pytest.mark.world("empty")
async def test_goal_on_way_that_is_walled_in_fails(tour: Tour) -> None:
    for x, y in ((5.6, 5.0), (4.4, 5.0), (5.0, 5.6), (5.0, 4.4)):
        tour.world.stage.add_obstacle(Pose(x, y, 0.0), (0.2, 1.4, 1.0) if y == 5.0 else (1.4, 0.2, 1.0))
    action = tour.head_for((2.0, 5.0), (5.0, 5.0), (2.0, 6.0))
    track = [tour.truth]
    await tour.end_of(action)
    assert isinstance(action.error, Blocked), (action.reason, track)


@pytest.mark.slow  # in short: test_success_means_every_goal_was_reached
@pytest.mark.world("office", body="hermes")
async def test_a_middle_goal_at_the_dock_itself(tour: Tour) -> None:
    wanted = [Point(1.0, 0.0), Point(0.0, 0.0), Point(1.0, 0.3)]
    action = tour.robot[Navigation].navigate_to(wanted, NavigationOptions(tolerance=TOLERANCE))
    track = [tour.truth.relative_to(tour.start)]
    while not action.status.ended:
        await tour.clock.advance(0.1)
        track.append(tour.truth.relative_to(tour.start))
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert passed_in_order(track, wanted, TOLERANCE + LOCALIZATION) == len(wanted)
