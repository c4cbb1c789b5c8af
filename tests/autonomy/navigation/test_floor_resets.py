"""Reset of a robot that has ridden the office's lift: judged by the world."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest

from roboglot.autonomy.building.floors import LiftFloors
from roboglot.control.lease_server import LeaseServer, Request
from roboglot.fleet import Fleet
from roboglot.model.actions import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.mapping.annotations import Area, AreaKind, MapAnnotations
from roboglot.model.components.mapping.floors import Floors, RideStage
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.docking import Docking
from roboglot.model.events import FloorReached
from roboglot.model.geometry import Point, Pose
from tests.autonomy.conftest import Tour
from tests.autonomy.delivery_robot import delivery_robot
from tests.autonomy.lift_rides import agreement, quick_lift, say_where_the_lift_is


@pytest.fixture
async def fleet(clock: LockstepClock) -> AsyncIterator[Fleet]:
    async with delivery_robot(clock) as built:
        yield built


@pytest.fixture
async def aboard(tour: Tour, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[LiftFloors]:
    """The floors of a robot that is in the lift at once."""
    async with quick_lift(tour, monkeypatch) as floors:
        yield floors


async def reset(tour: Tour, folder: Path) -> None:
    await LeaseServer(folder, tour.world.robots, tour.world.stage).do(Request("reset", "a"), tour.robot)


async def test_reset_robot_uses_start_floor(tour: Tour, aboard: LiftFloors, tmp_path: Path) -> None:
    kept, reached = Area(0, AreaKind.DANGEROUS, Point(1.0), Point(2.0), 0.5), list[FloorReached]()
    await tour.robot[MapAnnotations].change(lambda now: now.with_new(kept))
    await tour.clock.advance(1.0)
    downstairs, home = tour.robot[Mapping].grid, tour.robot[Docking].home
    action = await tour.end_of(aboard.ride(1))
    assert (action.status, aboard.current) == (ActionStatus.SUCCEEDED, 1)
    tour.robot.events.listen(FloorReached, reached.append)
    await reset(tour, tmp_path)
    assert (aboard.current, tour.robot[Docking].home) == (0, home)
    assert [(event.floor, event.place) for event in reached] == [(0, None)]
    assert tour.robot[MapAnnotations].current.areas == (replace(kept, id=1),)
    await tour.clock.advance(3.0)
    assert agreement(downstairs, tour.robot[Mapping].grid) > 0.95
    assert tour.robot[Mapping].enabled
    assert tour.error[0] < 0.05


async def test_reset_robot_is_in_no_lift(
    tour: Tour, aboard: LiftFloors, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It was in the car when it was reset, which then stops elsewhere."""
    lift = tour.robot[LiftClient]
    action = aboard.ride(1)
    await tour.until(lambda: action.feedback is RideStage.RIDING)
    await reset(tour, tmp_path)
    assert action.status is ActionStatus.CANCELED
    monkeypatch.setattr(type(lift), "state", replace(lift.state, floor=2, target=None))
    await tour.clock.advance(3.0)
    assert aboard.current == 0
    assert tour.robot[Mapping].enabled
    assert tour.error[0] < 0.05


@pytest.mark.slow  # a real ride; in short: test_reset_robot_uses_start_floor
async def test_goals_after_reset_upstairs_are_true(tour: Tour, tmp_path: Path) -> None:
    floors = tour.robot[Floors]
    await tour.go((4.5, 10.0))
    say_where_the_lift_is(tour)
    action = await tour.end_of(floors.ride(1), 400.0)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    await tour.clock.advance(3.0)
    await reset(tour, tmp_path)
    action = await tour.go((4.5, 10.0))
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.world.truth.floor_of("a") == floors.current == 0
    assert tour.truth.distance_to(Pose(4.5, 10.0)) < 0.2
    action = await tour.end_of(floors.ride(1), 400.0)  # its map of the other floor is kept
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.world.truth.floor_of("a") == floors.current == 1
