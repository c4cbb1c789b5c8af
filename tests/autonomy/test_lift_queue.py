"""Several robots that want the same lift: one after the other, in the order in which they asked."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator

import pytest

from roboglot.autonomy.building import lift_queue
from roboglot.autonomy.building.lift_queue import LiftQueue
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
        built.world.hands.remove_person(person)
    await built.start(wait=True)
    yield built
    await built.close()
    database.close()


async def test_each_has_its_turn(fleet: Fleet, clock: LockstepClock) -> None:
    seen = list[str]()

    async def ride(name: str) -> None:
        async def make_way() -> None:
            seen.append(f"{name} makes way")

        async with LiftQueue(fleet.robots[name]).turn(make_way):
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
            async with LiftQueue(fleet.robots[name]).turn(make_way):
                riding.append(name)
                most, rides = max(most, len(riding)), rides + 1
                await clock.sleep(0.3)
                riding.remove(name)

    turns = [asyncio.ensure_future(ride(name)) for name in NAMES]
    await clock.advance(12.0)
    await asyncio.gather(*turns)
    assert (most, rides) == (1, 12)


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
