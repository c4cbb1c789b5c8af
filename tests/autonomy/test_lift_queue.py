"""Several robots that want the same lift: one after the other, in the order in which they asked."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator

import pytest

from roboglot.autonomy.building import lift_queue
from roboglot.autonomy.building.lift_queue import turn
from roboglot.config import RobotConfig, StartConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.actions import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.geometry import Pose
from roboglot.storage.database import Database

NAMES = ("a", "b", "c")


@pytest.fixture
async def fleet(clock: LockstepClock, request: pytest.FixtureRequest) -> AsyncIterator[Fleet]:
    """Three delivery robots in front of the office's lift."""
    database, places = Database(":memory:"), ((4.5, 10.0), (5.8, 9.6), (7.0, 10.4))
    robots = [
        RobotConfig(name, "hermes", start=StartConfig(*at, math.pi)) for name, at in zip(NAMES, places, strict=True)
    ]
    built = build_fleet("office", robots, clock=clock, seed=1, database=database)
    for person in ("person 0 0", "person 0 1"):
        built.world.stage.remove_person(person)
    await built.start(wait=True)
    yield built
    await built.close()
    database.close()


@pytest.mark.slow  # in short: test_ride_from_within_the_car_comes_first
async def test_each_has_its_turn(fleet: Fleet, clock: LockstepClock) -> None:
    seen = list[str]()

    async def ride(name: str) -> None:
        async def make_way() -> None:
            seen.append(f"{name} makes way")

        async with turn(fleet.robots[name], make_way):
            seen.append(f"{name} rides")
            await clock.sleep(3.0)

    rides = [asyncio.ensure_future(ride(name)) for name in NAMES]
    await clock.advance(1.0)
    assert seen == ["a rides", "b makes way", "c makes way"]
    rides[1].cancel()
    await clock.advance(6.0)
    assert seen[3:] == ["a makes way", "c rides"]
    again = asyncio.ensure_future(ride("b"))
    await clock.advance(3.0)
    assert seen[5:] == ["b rides"]
    await clock.advance(3.0)
    await asyncio.gather(rides[0], rides[2], again)


@pytest.mark.slow
async def test_queue_never_runs_out_of_tickets(
    fleet: Fleet, clock: LockstepClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three take turns for ever: none gets a number that the others do not look at, and no two ride at once."""
    monkeypatch.setattr(lift_queue, "TICKETS_MAX", 3)
    riding, most, rides = list[str](), 0, 0

    async def make_way() -> None:
        pass

    async def ride(name: str) -> None:
        nonlocal most, rides
        for _ in range(4):
            async with turn(fleet.robots[name], make_way):
                riding.append(name)
                most, rides = max(most, len(riding)), rides + 1
                await clock.sleep(0.3)
                riding.remove(name)

    turns = [asyncio.ensure_future(ride(name)) for name in NAMES]
    await clock.advance(12.0)
    await asyncio.gather(*turns)
    assert (most, rides) == (1, 12)


@pytest.mark.slow
async def test_robot_that_stands_still_loses_its_turn(
    fleet: Fleet, clock: LockstepClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It gets the next one when it is under way again, and keeps that while it rides."""
    monkeypatch.setattr(lift_queue, "STILL_MAX", 12.0)
    seen, goes = list[str](), asyncio.Event()

    async def make_way() -> None:
        seen.append("way")

    async def stand() -> None:
        async with turn(fleet.robots["a"], make_way) as mine:
            await goes.wait()
            seen.append(f"a boards: {await mine.may_board()}")
            seen.append(f"a boards: {await mine.may_board()}")
            await clock.sleep(lift_queue.STILL_MAX + 5.0)
            seen.append("a was aboard")

    async def ride() -> None:
        async with turn(fleet.robots["b"], make_way) as mine:
            seen.append(f"b boards: {await mine.may_board()}")
            await clock.sleep(10.0)

    rides = [asyncio.ensure_future(stand()), asyncio.ensure_future(ride())]
    await clock.advance(lift_queue.STILL_MAX - 5.0)
    assert seen == ["way"]
    await clock.advance(10.0)
    assert seen == ["way", "b boards: True"]
    goes.set()
    await clock.advance(10.0)
    assert seen[2:] == ["way", "way", "a boards: False", "a boards: True"]
    last = asyncio.ensure_future(ride())
    await clock.advance(lift_queue.STILL_MAX + 10.0)
    assert seen[6:] == ["way", "a was aboard", "way", "b boards: True"]
    await clock.advance(11.0)
    await asyncio.gather(*rides, last)


async def test_ride_from_within_the_car_comes_first(fleet: Fleet, clock: LockstepClock) -> None:
    """A robot that was restarted in the car occupies it: whose turn it was waits."""
    seen = list[str]()

    async def make_way() -> None:
        pass

    async def ride(name: str, *, aboard: bool) -> None:
        async with turn(fleet.robots[name], make_way, aboard=aboard) as mine:
            await clock.sleep(2.0)  # the lift comes
            while not mine.aboard:
                await mine.may_board()
            seen.append(f"{name} rides")
            await clock.sleep(3.0)
            seen.append(f"{name} rode")

    rides = [asyncio.ensure_future(ride("a", aboard=False)), asyncio.ensure_future(ride("b", aboard=True))]
    await clock.advance(10.0)
    assert seen == ["b rides", "b rode", "a rides", "a rode"]
    await asyncio.gather(*rides)


@pytest.mark.slow  # two minutes of three robots; the order: test_each_has_its_turn
async def test_three_take_the_lift(fleet: Fleet, clock: LockstepClock) -> None:
    """Each leaves the door upstairs free for the next one, which would be stuck in the car."""
    truth = fleet.world.truth
    await clock.advance(2.0)
    for name, robot in fleet.robots.items():
        start = truth.pose_of(name)
        robot[Mapping].enable(True)
        waiting, inside = (Pose(x, 10.0, math.pi).relative_to(start) for x in (2.7, 1.0))
        robot[Floors].set_lift(waiting, inside)
    rides = [robot[Floors].ride(1) for robot in fleet.robots.values()]
    ended = list[float]()
    while len(ended) < len(rides) and clock.time() < 240.0:
        await clock.advance(1.0)
        ended += [clock.time()] * (sum(ride.status.ended for ride in rides) - len(ended))
    assert [ride.status for ride in rides] == [ActionStatus.SUCCEEDED] * 3, [ride.reason for ride in rides]
    assert [truth.floor_of(name) for name in NAMES] == [1, 1, 1]
    assert len(set(ended)) == 3
