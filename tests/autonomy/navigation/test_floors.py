"""Riding the office's lift: judged by the world."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from dataclasses import replace
from typing import Any, TypedDict

import pytest
from msgspec import structs

from roboglot.autonomy.building.floor_storage import FloorStorage, Storey
from roboglot.autonomy.building.floors import LiftFloors
from roboglot.autonomy.slam.evidence import EvidenceGrid
from roboglot.fleet import Fleet
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.mapping.annotations import (
    Annotations,
    Area,
    AreaKind,
    MapAnnotations,
)
from roboglot.model.components.mapping.floors import Floors, RideStage
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import MapMemory
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.errors import Blocked, InvalidGoal, Refused
from roboglot.model.events import ActionChanged, FloorReached, MapReplaced
from roboglot.model.geometry import Point, Pose
from roboglot.simulation.components.sensing.lidar import SimulatedLidar
from tests.autonomy.conftest import Tour
from tests.autonomy.delivery_robot import delivery_robot
from tests.autonomy.lift_rides import agreement, quick_lift, say_where_the_lift_is
from tests.narrowing import known


@pytest.fixture
async def fleet(clock: LockstepClock) -> AsyncIterator[Fleet]:
    async with delivery_robot(clock) as built:
        yield built


@pytest.mark.slow  # a long story; tests/simulation/building/test_lift.py has the ride
async def test_up_and_down_with_maps_and_docks(tour: Tour) -> None:
    floors, reported = tour.robot[Floors], []
    await tour.go((4.5, 10.0))
    say_where_the_lift_is(tour)
    downstairs = tour.robot[Mapping].grid
    tour.robot.events.listen(ActionChanged, lambda event: reported.append(event.action.feedback))
    action = await tour.end_of(floors.ride(1), 400.0)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert [t for t in dict.fromkeys(reported) if isinstance(t, RideStage)] == list(RideStage)
    assert tour.world.truth.floor_of("a") == floors.current == 1
    assert tour.truth.x > 2.4
    assert tour.robot[Docking].home is None
    await tour.clock.advance(3.0)
    upstairs, drawn = tour.robot[Mapping].grid, Area(0, AreaKind.DANGEROUS, Point(1.0), Point(2.0), 0.5)
    await tour.robot[MapAnnotations].change(lambda now: now.with_new(drawn))
    assert upstairs.log_odds.shape != downstairs.log_odds.shape
    action = await tour.end_of(floors.ride(0), 400.0)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.world.truth.floor_of("a") == floors.current == 0
    await tour.clock.advance(2.0)
    assert tour.error[0] < 0.05
    grid = tour.robot[Mapping].grid
    assert agreement(downstairs, grid) > 0.95  # this floor's map is back
    assert agreement(upstairs, grid) < 0.5
    action = await tour.go((3.5, 10.0))
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.robot[Docking].home is not None
    assert tour.robot[MapAnnotations].current.areas == ()
    kept = await FloorStorage(tour.robot).take(1)  # as after a restart: only what is on disk
    assert kept is not None
    assert agreement(upstairs, kept.map.occupancy()) > 0.98
    assert kept.drawn.areas == (replace(drawn, id=1),)
    assert kept.waiting.distance_to(kept.inside) == pytest.approx(1.7)


async def test_unreadable_or_unwritable_floor_on_disk_is_reported(tour: Tour, caplog: pytest.LogCaptureFixture) -> None:
    robot, storage = tour.robot, FloorStorage(tour.robot)
    for data in (b"", b"garbage", b"\x80"):
        await robot[FileStore].write("floors/2.msgpack", data)
        assert await storage.take(2) is None
    assert caplog.text.count("cannot read") == 3
    tour.world.faults.inject("full_disk", "a")
    storey = Storey(EvidenceGrid(), None, Annotations(), Pose(1.0), Pose())
    await storage.put(1, storey, lasting=True)
    assert "kept in memory only" in caplog.text
    assert await storage.take(1) is storey
    assert await storage.take(1) is None


@pytest.mark.slow
async def test_a_lift_out_of_service_is_not_boarded(tour: Tour) -> None:
    say_where_the_lift_is(tour)
    known(tour.world.building.lift).take_out_of_service(True)
    action = await tour.end_of(tour.robot[Floors].ride(2), 400.0)
    assert isinstance(action.error, Refused)
    assert tour.truth.x > 2.4


async def leave_the_lift(tour: Tour) -> Action:
    """Return a ride to floor 1 that begins to leave the car there."""
    say_where_the_lift_is(tour)
    await tour.go((2.7, 10.0), deg=180)
    action = tour.robot[Floors].ride(1)
    await tour.until(lambda: action.feedback is RideStage.LEAVING, 400.0)
    return action


@pytest.mark.slow
async def test_ride_succeeds_outside_a_lift_that_has_failed(tour: Tour) -> None:
    action = await leave_the_lift(tour)
    await tour.until(lambda: tour.truth.x > 2.2)
    known(tour.world.building.lift).take_out_of_service(True)
    await tour.end_of(action)
    assert tour.world.truth.floor_of("a") == 1
    assert action.status is ActionStatus.SUCCEEDED, action.reason


@pytest.mark.slow  # long; in short: test_given_up_ride_mixes_no_floors
async def test_ride_in_lift_that_leaves_fails(tour: Tour, monkeypatch: pytest.MonkeyPatch) -> None:
    """It does not get out on another floor and call that the goal."""
    action, lift = await leave_the_lift(tour), known(tour.world.building.lift)
    with monkeypatch.context() as crowded:
        crowded.setattr("roboglot.autonomy.building.floors.ROOM", math.inf)
        await tour.clock.advance(0.1)
        lift.close_door()
        lift.call(2)
        await tour.until(lambda: lift.floor == 2 and lift.rests)
    await tour.end_of(action)
    assert isinstance(action.error, Refused), action.reason
    assert tour.truth.x < 1.2
    action = await tour.end_of(tour.robot[Floors].ride(1), 400.0)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.world.truth.floor_of("a") == 1


@pytest.mark.slow  # long; in short: test_given_up_ride_mixes_no_floors
async def test_ride_given_up_in_the_car(tour: Tour) -> None:
    floors, reached = tour.robot[Floors], list[int]()
    say_where_the_lift_is(tour)
    tour.robot.events.listen(FloorReached, lambda event: reached.append(event.floor))
    await tour.go((2.7, 10.0), deg=180)
    downstairs = tour.robot[Mapping].grid
    action = floors.ride(1)
    await tour.until(lambda: action.feedback is RideStage.RIDING, 400.0)
    await tour.clock.advance(4.0)
    action.cancel("the client thinks better of it")
    lift = known(tour.world.building.lift)
    await tour.until(lambda: lift.floor == 1 and lift.rests, 60.0)
    await tour.clock.advance(1.5)
    assert action.status is ActionStatus.CANCELED
    assert tour.world.truth.floor_of("a") == floors.current == 1
    assert agreement(downstairs, tour.robot[Mapping].grid) < 0.5
    lift.call(2)
    await tour.until(lambda: lift.floor == 2 and lift.rests, 60.0)
    await tour.clock.advance(1.5)
    assert (reached, floors.current) == ([1, 2], 2)
    action = await tour.end_of(floors.ride(0), 400.0)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.world.truth.floor_of("a") == floors.current == 0
    assert tour.robot[Mapping].enabled
    await tour.clock.advance(2.0)
    assert tour.error[0] < 0.05
    assert agreement(downstairs, tour.robot[Mapping].grid) > 0.95


@pytest.fixture
async def aboard(tour: Tour, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[LiftFloors]:
    """The floors of a robot that is in the lift at once."""
    async with quick_lift(tour, monkeypatch) as floors:
        yield floors


async def test_closing_server_begins_no_stay(tour: Tour, aboard: LiftFloors) -> None:
    action = aboard.ride(1)
    await tour.until(lambda: action.feedback is RideStage.RIDING)
    known(action._task).cancel()  # as a closing loop does
    await tour.end_of(action)
    assert aboard._stay is None


@pytest.mark.parametrize("closing", [False, True])
async def test_given_up_ride_mixes_no_floors(
    tour: Tour, aboard: LiftFloors, monkeypatch: pytest.MonkeyPatch, *, closing: bool
) -> None:
    await tour.robot[MapAnnotations].change(
        lambda now: now.with_new(Area(0, AreaKind.DANGEROUS, Point(1.0), Point(2.0), 0.5))
    )
    action, store = aboard.ride(1), type(tour.robot[MapAnnotations])
    change = store.change

    async def given_up_meanwhile(*arguments: Any) -> None:
        action.cancel("the client thinks better of it")
        await asyncio.sleep(0)
        if closing:  # in that very moment the loop closes, too
            known(action._task).cancel()
            await asyncio.sleep(0)
        await change(*arguments)

    monkeypatch.setattr(store, "change", given_up_meanwhile)
    await tour.end_of(action)
    await tour.until(lambda: aboard.current == 1, 1.0)
    assert action.status is ActionStatus.CANCELED
    assert tour.robot[MapAnnotations].current.areas == ()


async def test_no_stay_outlives_the_robot(tour: Tour, aboard: LiftFloors) -> None:
    """Cut off in the car by the end of the program, or by a door that closes before it."""
    for _ in range(2):
        action = aboard.ride(1)
        await tour.until(tour.robot.actions.running)
        await tour.clock.advance(1.0)
        action.cancel("the door closes")
        await tour.end_of(action)
        aboard.close()
        await asyncio.sleep(0)
        assert not [task for task in asyncio.all_tasks() if "in the lift" in task.get_name()]
    assert tour.robot[MapMemory].settled


async def test_drawings_are_awaited_after_given_up_ride(
    tour: Tour, aboard: LiftFloors, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An action that waits for the ride to end would look up places of the floor that the robot has left."""
    memory, lift, listen = tour.robot[MapMemory], tour.robot[LiftClient], tour.robot.events.listen
    settled = dict[str, bool]()
    action = aboard.ride(1, redraw=False)
    await tour.until(lambda: action.feedback is RideStage.RIDING)
    monkeypatch.setattr(type(lift), "state", replace(lift.state, floor=1, target=None))
    action.cancel("the client thinks better of it")
    listen(FloorReached, lambda event: settled.update({f"floor {event.floor}": memory.settled}))
    listen(ActionChanged, lambda event: settled.update({event.action.status.name: memory.settled}))
    await tour.end_of(action)
    await tour.clock.advance(1.0)
    assert settled["CANCELED"] is settled["floor 1"] is False
    assert memory.settled


async def test_lift_keeps_its_place_under_moved_origin(tour: Tour) -> None:
    say_where_the_lift_is(tour)
    floors = tour.robot[Floors]
    assert isinstance(floors, LiftFloors)
    tour.robot[Mapping].move_origin(Point(1.0, -2.0))
    tour.robot[Mapping].clear()
    origin = tour.truth.compose(tour.robot[Localization].pose.inverse())
    places = [origin.compose(place) for place in known(floors._places)]
    assert [(place.x, place.y) for place in places] == [pytest.approx((x, 10.0), abs=0.1) for x in (2.7, 1.0)]


async def test_ride_begins_where_the_car_stopped(
    tour: Tour, aboard: LiftFloors, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("roboglot.autonomy.building.floors.STAY_PERIOD", 2.0)
    lift, maps = tour.robot[LiftClient], list[MapReplaced]()
    action = aboard.ride(1)
    await tour.until(lambda: action.feedback is RideStage.RIDING)
    action.cancel("the client thinks better of it")
    await tour.end_of(action)
    tour.robot.events.listen(MapReplaced, maps.append)
    monkeypatch.setattr(type(lift), "state", replace(lift.state, floor=1, target=None))
    aboard.begin_on(0)  # a client that has not heard of the stop
    action = await tour.end_of(aboard.ride(2))
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert (aboard.current, len(maps)) == (2, 2)  # first the floor of the stop, then the ride's


@pytest.mark.slow
async def test_covered_lidar_is_no_free_way(tour: Tour) -> None:
    """A covered lidar measures nothing, which was taken for an empty door."""
    action, lidar = await leave_the_lift(tour), tour.robot[Lidar]
    assert isinstance(lidar, SimulatedLidar)
    await tour.clock.advance(0.2)
    lidar._section = structs.replace(lidar._section, dropouts=1.0)
    await tour.clock.advance(1.0)
    stood = tour.truth
    await tour.end_of(action)
    assert isinstance(action.error, Blocked), action.reason
    assert action.reason == "the lidar is silent"
    assert tour.truth.distance_to(stood) < 0.02


class Where(TypedDict, total=False):
    """Options of a fault."""

    floor: int


@pytest.mark.slow  # the ride itself: test_ride_succeeds_outside_a_lift_that_has_failed
@pytest.mark.parametrize(
    ("fault", "options", "stage", "floor"),
    [
        ("lift_occupied", Where(), RideStage.BOARDING, 0),
        ("lift_door_blocked", Where(), RideStage.BOARDING, 0),
        ("lift_door_blocked", Where(floor=1), RideStage.LEAVING, 1),
    ],
)
async def test_a_ride_that_is_in_somebodys_way(
    tour: Tour, fault: str, options: Where, stage: RideStage, floor: int
) -> None:
    say_where_the_lift_is(tour)
    await tour.go((2.7, 10.0), deg=180)
    (blocked,) = tour.world.faults.inject(fault, **options)
    action = await tour.end_of(tour.robot[Floors].ride(1), 400.0)
    assert isinstance(action.error, Blocked), action.reason
    assert action.feedback is stage
    assert tour.world.truth.floor_of("a") == tour.robot[Floors].current == floor
    assert not tour.bumps
    if stage is RideStage.LEAVING:  # from inside the car the ride starts at once
        tour.world.faults.clear(blocked.number)
        action = await tour.end_of(tour.robot[Floors].ride(0), 400.0)
        assert action.status is ActionStatus.SUCCEEDED, action.reason
        assert tour.world.truth.floor_of("a") == 0
        assert tour.truth.x > 2.4


async def test_nonsense_is_refused(tour: Tour) -> None:
    floors = tour.robot[Floors]
    with pytest.raises(InvalidGoal):
        floors.ride(1)  # no lift is known
    for waiting, inside in ((Pose(), Pose()), (Pose(), Pose(math.nan, 0.0)), (Pose(), Pose(50.0, 0.0))):
        with pytest.raises(InvalidGoal):
            floors.set_lift(waiting, inside)
    say_where_the_lift_is(tour)
    with pytest.raises(InvalidGoal):
        floors.ride(7)
