"""A long life in short: what has ended keeps nothing of what it went through."""

from __future__ import annotations

import gc
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from roboglot.autonomy.navigation.pilot import Pilot
from roboglot.autonomy.navigation.planner import PlanningTask
from roboglot.model.actions import HISTORY_MAX, Action, ActionStatus
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.errors import Unreachable
from roboglot.model.geometry import Point, Pose, Twist

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour

pytestmark = pytest.mark.world("empty")
ROUNDS = 5
GROWTH_MAX = 1.05


def kinds(tour: Tour) -> list[Callable[[], Action]]:
    """Ways to start actions that succeed, fail and are replaced."""
    robot, options = tour.robot, NavigationOptions()
    navigation, driving = robot[Navigation], robot[Driving]
    return [
        lambda: navigation.navigate_to([Point(12.0, 0.0)], options),  # behind the wall
        lambda: navigation.navigate_to([Point(60.0, 0.0)], options),  # off the map
        lambda: navigation.navigate_to([Point(1.0, 0.0), Point(0.8, 0.2)], options),
        lambda: driving.move_by(Pose(x=0.05)),
        lambda: driving.drive(Twist(x=-0.1), lifetime=0.5),
        lambda: robot[Localization].relocalize(),
        lambda: navigation.navigate_to([Point(6.0, 0.0)], options),  # replaced
    ]


def _alive() -> list[object]:
    """Return what is kept; by type, as asking a weak proxy of other tests for its class may raise."""
    return [kept for kept in gc.get_objects() if issubclass(type(kept), (Pilot, PlanningTask))]


@pytest.mark.slow  # hundreds of actions; benchmarks/robots/soak.py has the long run
async def test_ended_actions_keep_nothing(tour: Tour) -> None:
    sizes: list[int] = []
    starts = kinds(tour)
    earlier = _alive()  # pytest keeps the frames of tests that failed before
    known = {id(kept) for kept in earlier}
    for _ in range(ROUNDS):
        for start in starts:
            action = start()
            for _ in range(15):
                await tour.clock.advance(0.2)
                if action.status.ended:
                    break
        gc.collect()
        sizes.append(len(gc.get_objects()))
    assert len(tour.robot.actions.history) == HISTORY_MAX
    outcomes = {action.status for action in tour.robot.actions.history}
    assert outcomes == {ActionStatus.SUCCEEDED, ActionStatus.ABORTED, ActionStatus.CANCELED}
    left = [kept for kept in _alive() if id(kept) not in known]
    assert not [kept for kept in left if isinstance(kept, PlanningTask)]
    assert len(left) <= 1  # the pilot of the drive that is under way
    settled = sizes[HISTORY_MAX // len(starts) + 1]  # the history is full
    assert sizes[-1] <= settled * GROWTH_MAX


@pytest.mark.slow
async def test_errors_asked_for_again_and_again_keep_nothing(tour: Tour) -> None:
    action = await tour.go((20.0, 5.0))
    for _ in range(5):
        with pytest.raises(Unreachable) as raised:
            await action.succeeded()
        assert str(raised.value) == action.reason
    assert action.error is not None
    assert action.error.__traceback__ is None


async def test_standing_long_and_new_maps_leave_no_trajectory(tour: Tour) -> None:
    localization: Any = tour.robot[Localization]
    await tour.end_of(tour.robot[Driving].move_by(Pose(1.0)))
    driven = len(localization.estimator.trajectory())
    assert driven > 10
    await tour.clock.advance(60.0)
    assert len(localization.estimator.trajectory()) <= driven + 8
    tour.robot[Mapping].clear()
    await tour.clock.advance(1.0)
    assert len(localization.estimator.trajectory()) <= 2
