"""Riding the office's lift: judged by the world."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING

import pytest

from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.actions import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.docking import Docking
from roboglot.model.components.floors import Floors, RideStage
from roboglot.model.components.mapping import Mapping
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.events import ActionChanged
from roboglot.model.geometry import Pose
from roboglot.storage.database import Database

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour


@pytest.fixture
async def fleet(clock: LockstepClock) -> AsyncIterator[Fleet]:
    """The delivery robot, which has a lift radio."""
    database = Database(":memory:")
    built = build_fleet("office", [RobotConfig(body="hermes")], clock=clock, seed=1, database=database)
    await built.start(wait=True)
    yield built
    await built.close()
    database.close()


def say_where_the_lift_is(tour: Tour) -> None:
    waiting, inside = (Pose(x, 10.0, math.pi).relative_to(tour.start) for x in (2.7, 1.0))
    tour.robot[Floors].set_lift(waiting, inside)


async def test_up_and_down_again_with_a_map_and_a_dock_a_floor(tour: Tour) -> None:
    floors, told = tour.robot[Floors], []
    await tour.go((6.0, 10.0))
    say_where_the_lift_is(tour)
    downstairs = tour.robot[Mapping].grid
    tour.robot.events.listen(ActionChanged, lambda event: told.append(event.action.feedback))
    action = await tour.end_of(floors.ride(1), 400.0)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert [t for t in dict.fromkeys(told) if isinstance(t, RideStage)] == list(RideStage)
    assert tour.world.floor_of("a") == floors.current == 1
    assert tour.truth.x > 2.4
    assert tour.robot[Docking].home is None
    await tour.clock.advance(3.0)
    upstairs = tour.robot[Mapping].grid
    assert upstairs.log_odds.shape != downstairs.log_odds.shape
    action = await tour.end_of(floors.ride(0), 400.0)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.world.floor_of("a") == floors.current == 0
    await tour.clock.advance(2.0)
    assert tour.error[0] < 0.05
    grid = tour.robot[Mapping].grid
    assert abs(grid.origin.x - downstairs.origin.x) < 0.5  # the map of this floor again
    assert grid.origin.distance_to(upstairs.origin) > 1.0
    action = await tour.go((6.0, 10.0))
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.robot[Docking].home is not None


async def test_a_lift_out_of_service_is_not_boarded(tour: Tour) -> None:
    say_where_the_lift_is(tour)
    assert tour.world.building.lift is not None
    tour.world.building.lift.take_out_of_service(True)
    action = await tour.end_of(tour.robot[Floors].ride(2), 400.0)
    assert isinstance(action.error, Refused)
    assert tour.truth.x > 2.4


async def test_nonsense_is_refused(tour: Tour) -> None:
    floors = tour.robot[Floors]
    with pytest.raises(InvalidGoal):
        floors.ride(1)  # where is the lift?
    for waiting, inside in ((Pose(), Pose()), (Pose(), Pose(math.nan, 0.0)), (Pose(), Pose(50.0, 0.0))):
        with pytest.raises(InvalidGoal):
            floors.set_lift(waiting, inside)
    say_where_the_lift_is(tour)
    with pytest.raises(InvalidGoal):
        floors.ride(7)
