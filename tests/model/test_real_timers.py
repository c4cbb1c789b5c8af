"""Timers of a clock that goes on by itself, on hours that the test sets."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from functools import partial

import pytest

from roboglot.model.clock_base import CANCELLED_MAX, STRETCH, RealTimers


class Hours:
    """Robot time that stands still; its timers are as good as due when it is moved."""

    def __init__(self) -> None:
        self.now = 0.0
        self.rung: list[str] = []
        self.timers = RealTimers(lambda when: max(0.0, when - self.now), lambda when: when <= self.now)

    def note(self, what: str) -> Callable[[], None]:
        return lambda: self.rung.append(what)

    async def reach(self, now: float) -> None:
        self.now = now
        self.timers.arm()
        for _ in range(5):
            await asyncio.sleep(0)


async def test_timers_fire_by_time_then_by_registration() -> None:
    hours = Hours()
    for what, when in (("late", 3.0), ("first", 2.0), ("second", 2.0), ("far", 1e6)):
        hours.timers.add(when, hours.note(what))
    await hours.reach(3.0)
    assert hours.rung == ["first", "second", "late"]
    assert len(hours.timers) == 1


async def test_timer_of_the_same_moment_can_be_cancelled() -> None:
    hours = Hours()
    hours.timers.add(1.0, lambda: second.cancel())
    second = hours.timers.add(1.0, hours.note("second"))
    await hours.reach(1.0)
    assert hours.rung == []
    assert len(hours.timers) == 0


async def test_timers_added_by_timers_come_later() -> None:
    hours = Hours()

    def add() -> None:
        hours.note("adding")()
        hours.timers.add(0.5, hours.note("added"))

    hours.timers.add(1.0, add)
    hours.timers.add(1.0, hours.note("beside"))
    await hours.reach(1.0)
    assert hours.rung == ["adding", "beside", "added"]


@pytest.mark.parametrize("kind", [ZeroDivisionError, asyncio.CancelledError])
async def test_error_of_one_timer_affects_no_other(kind: type[BaseException]) -> None:
    hours, errors = Hours(), list[object]()
    asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context["exception"]))

    def fail() -> None:
        raise kind

    hours.timers.add(1.0, fail)
    hours.timers.add(1.0, hours.note("next"))
    await hours.reach(1.0)
    assert hours.rung == ["next"]
    assert [type(error) for error in errors] == [kind]


async def test_nan_stops_no_other_timer() -> None:
    hours = Hours()
    hours.timers.add(math.nan, hours.note("at once"))
    hours.timers.add(1.0, hours.note("next"))
    await hours.reach(1.0)
    assert hours.rung == ["at once", "next"]


async def test_cancelled_timers_take_no_memory() -> None:
    hours = Hours()
    for number in range(10_000):
        hours.timers.add(1e6 + number, hours.note("never")).cancel()
    assert len(hours.timers._heap) <= CANCELLED_MAX + 1
    hours.timers.add(1.0, hours.note("soon"))
    await hours.reach(1.0)
    assert hours.rung == ["soon"]
    assert len(hours.timers) == 0


async def test_many_timers_leave_the_loop_its_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    hours, now = Hours(), [0.0]
    monkeypatch.setattr("roboglot.model.clock_base.time.perf_counter", lambda: now[0])

    def work(name: str) -> None:
        hours.rung.append(name)
        asyncio.get_running_loop().call_soon(hours.rung.append, "socket")
        now[0] += 0.6 * STRETCH

    timers = [hours.timers.add(1.0, partial(work, name)) for name in "abcde"]
    hours.now = 1.0
    hours.timers._ring()
    assert hours.rung == ["a", "b"]
    timers[3].cancel()
    for _ in range(20):
        await asyncio.sleep(0)
    assert [rung for rung in hours.rung if rung != "socket"] == ["a", "b", "c", "e"]
    assert hours.rung[2] == "socket"
    assert len(hours.timers) == 0
