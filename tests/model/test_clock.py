"""Clocks: the lockstep one is exact and ordered, the real one keeps its pace."""

from __future__ import annotations

import asyncio
import gc
import math
from collections.abc import Callable
from contextvars import ContextVar
from functools import partial

import pytest
import uvloop
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.clock import LOCKSTEP_EPOCH, LockstepClock, RealClock
from tests.slow_machine import Hours


async def test_nothing_happens_until_time_passes() -> None:
    clock = LockstepClock()
    sleeper = asyncio.ensure_future(clock.sleep(1.0))
    await clock.advance(0.999)
    assert not sleeper.done()
    await clock.advance(0.001)
    assert sleeper.done()
    assert clock.epoch() == LOCKSTEP_EPOCH + clock.time()


@pytest.mark.parametrize("loop", [asyncio.new_event_loop, uvloop.new_event_loop])
def test_consequences_come_before_the_next_instant(loop: Callable[[], asyncio.AbstractEventLoop]) -> None:
    with asyncio.Runner(loop_factory=loop) as runner:
        runner.run(chains_of_wake_ups())


async def chains_of_wake_ups() -> None:
    clock, trace = LockstepClock(), []

    async def relay(name: str, delay: float) -> None:
        await clock.sleep(delay)
        for _ in range(20):  # a long chain of wake-ups within one instant
            await asyncio.sleep(0)
        trace.append((name, clock.time()))
        await clock.sleep(0.5)
        trace.append((name, clock.time()))

    tasks = [asyncio.ensure_future(relay("late", 0.2)), asyncio.ensure_future(relay("early", 0.1))]
    await clock.advance(1.0)
    assert trace == [("early", 0.1), ("late", 0.2), ("early", 0.6), ("late", 0.7)]
    await asyncio.gather(*tasks)


@given(st.lists(st.floats(0, 10), max_size=30))
def test_callbacks_run_by_time_then_by_registration(times: list[float]) -> None:
    async def run() -> list[int]:
        clock, order = LockstepClock(), []
        for index, when in enumerate(times):
            clock.call_at(when, partial(order.append, index))
        await clock.advance(10)
        return order

    assert asyncio.run(run()) == [i for _, i in sorted((when, i) for i, when in enumerate(times))]


async def test_cancelled_timer_never_fires() -> None:
    clock, fired = LockstepClock(), []
    clock.call_later(1, lambda: fired.append(1)).cancel()
    await clock.advance(2)
    assert fired == []


async def test_every_does_not_drift() -> None:
    clock, beats = LockstepClock(), []

    async def drum() -> None:
        async for now in clock.every(0.1):
            beats.append(now)
            await clock.sleep(0.03)  # slow work must not shift the beat

    task = asyncio.ensure_future(drum())
    await clock.advance(1.0)
    task.cancel()
    assert beats == pytest.approx([0.1 * n for n in range(1, 11)])


async def test_every_skips_what_it_missed() -> None:
    clock, beats = LockstepClock(), []

    async def drum() -> None:
        async for now in clock.every(0.1):
            beats.append(round(now, 3))
            await clock.sleep(0.25)

    task = asyncio.ensure_future(drum())
    await clock.advance(1.0)
    task.cancel()
    assert beats == [0.1, 0.4, 0.7, 1.0]


async def test_steps_come_in_time_in_their_context() -> None:
    clock, word, seen = LockstepClock(), ContextVar("word", default=""), list[tuple[float, str]]()

    def step() -> float | None:
        seen.append((clock.time(), word.get()))
        return 0.25 * len(seen) if len(seen) < 4 else None

    async def work() -> None:
        word.set("mine")
        await clock.keep_calling(step)
        seen.append((clock.time(), "end"))

    task = asyncio.ensure_future(work())
    await clock.advance(5.0)
    await task
    assert seen == [(0.0, "mine"), (0.25, "mine"), (0.75, "mine"), (1.5, "mine"), (1.5, "end")]


@pytest.mark.parametrize("clock", [LockstepClock(), RealClock()])
async def test_no_step_after_an_error_or_a_cancellation(clock: LockstepClock | RealClock) -> None:
    calls, failing = 0, False

    def step() -> float | None:
        nonlocal calls
        calls += 1
        if failing and calls > 1:
            raise ValueError("no further")
        return 0.001

    async def pass_time() -> None:
        await (clock.advance(0.01) if isinstance(clock, LockstepClock) else clock.sleep(0.01))

    task = asyncio.ensure_future(clock.keep_calling(step))
    await pass_time()
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    before = calls
    await pass_time()
    assert calls == before > 1
    calls, failing = 0, True
    task = asyncio.ensure_future(clock.keep_calling(step))
    await asyncio.sleep(0)
    while not task.done():
        await pass_time()
    with pytest.raises(ValueError, match="no further"):
        await task
    assert calls == 2


def unheard_errors() -> list[object]:
    """New futures of this loop with an error that was not taken; collecting them would bring up other tests'."""
    loop = asyncio.get_running_loop()
    young = [*gc.get_objects(0), *gc.get_objects(1)]  # the rest of the worker is a hundred times as much
    futures = [found for found in young if issubclass(type(found), asyncio.Future)]
    return [future for future in futures if future.get_loop() is loop and future._log_traceback]


@pytest.mark.parametrize("before", [True, False])
@pytest.mark.parametrize("failing", [True, False])
async def test_last_step_may_cancel_its_task(before: bool, failing: bool) -> None:
    clock, calls = LockstepClock(), 0
    reported: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: reported.append(context))

    def step() -> float | None:
        nonlocal calls
        calls += 1
        if calls < 3:
            return 0.1
        task.cancel() if before else asyncio.get_running_loop().call_soon(task.cancel)
        if failing:
            raise ValueError("no further")
        return None

    task = asyncio.ensure_future(clock.keep_calling(step))
    await clock.advance(1.0)
    await asyncio.wait([task])
    assert calls == 3
    if before:
        assert task.cancelled()
    elif not task.cancelled():
        task.exception()
    assert not reported
    assert not unheard_errors(), "they would be reported when they are collected"


async def test_wait_for_gives_up_in_robot_time() -> None:
    clock = LockstepClock()
    waiting = asyncio.ensure_future(clock.wait_for(asyncio.get_running_loop().create_future(), 2.0))
    await clock.advance(1.9)
    assert not waiting.done()
    await clock.advance(0.2)
    with pytest.raises(TimeoutError):
        await waiting


async def test_wait_for_passes_results_and_cancellation_on() -> None:
    clock = LockstepClock()
    done: asyncio.Future[int] = asyncio.get_running_loop().create_future()
    done.set_result(7)
    assert await clock.wait_for(done, 1) == 7
    inner: asyncio.Future[int] = asyncio.get_running_loop().create_future()
    waiting = asyncio.ensure_future(clock.wait_for(inner, 1))
    await asyncio.sleep(0)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    assert inner.cancelled()


async def test_cancellation_at_the_moment_of_timeout_wins() -> None:
    clock = LockstepClock()

    async def slow() -> None:
        try:
            await asyncio.get_running_loop().create_future()
        finally:
            waiting.cancel()

    waiting = asyncio.ensure_future(clock.wait_for(slow(), 1))
    await clock.advance(2)
    with pytest.raises(asyncio.CancelledError):
        await waiting


async def test_timeout_after_a_survived_cancellation_is_one() -> None:
    clock = LockstepClock()

    async def stubborn() -> None:
        try:
            await clock.sleep(1)
        except asyncio.CancelledError:
            await clock.wait_for(asyncio.get_running_loop().create_future(), 1)

    waiting = asyncio.ensure_future(stubborn())
    await asyncio.sleep(0)
    waiting.cancel()
    await clock.advance(2)
    with pytest.raises(TimeoutError):
        await waiting


async def test_a_scaled_clock_runs_faster() -> None:
    clock = RealClock(speed=100)
    loop = asyncio.get_running_loop()
    start, began = clock.time(), loop.time()
    await clock.sleep(2.0)
    assert clock.time() - start >= 2.0
    assert loop.time() - began < 1.0  # a tenth of robot time even on a very busy machine


@pytest.mark.parametrize("speed", [0, -1, float("nan")])
def test_a_clock_needs_a_speed(speed: float) -> None:
    with pytest.raises(ValueError, match="above 0"):
        RealClock(speed)


@given(steps=st.lists(st.tuples(st.sampled_from(["pass", "pause", "resume", "speed", "step"]), st.floats(0.01, 50.0))))
def test_steered_time_is_the_sum_of_running_time(steps: list[tuple[str, float]]) -> None:
    with pytest.MonkeyPatch.context() as monkeypatch:
        hours = Hours(monkeypatch)
        clock = RealClock()
        expected, speed, until = 0.0, 1.0, math.inf
        for what, value in steps:
            before = clock.time()
            if what == "pass":
                hours.now += value
                expected = min(expected + value * speed, until)
            elif what == "pause":
                clock.pause()
                until = expected
            elif what == "resume":
                clock.resume()
                until = math.inf
            elif what == "speed":
                clock.set_speed(value)
                speed = value
            else:
                clock.step(value)
                until = expected + value
            assert clock.time() >= before
            assert clock.time() == pytest.approx(expected, abs=1e-6)
            if what in ("pause", "resume"):
                assert clock.paused == (what == "pause")


async def test_paused_clock_holds_sleepers_until_a_step() -> None:
    clock = RealClock(speed=1000.0)
    clock.pause()
    now = clock.time()
    sleeper = asyncio.ensure_future(clock.sleep_until(now + 1.0))
    await asyncio.sleep(0)
    assert clock.real_seconds_until(now + 1.0) is None
    clock.step(0.5)
    assert clock.real_seconds_until(now + 1.0) is None
    clock.step(1.0)
    await sleeper
    assert now + 1.0 <= clock.time() <= now + 1.5 + 1e-9


async def test_a_faster_clock_wakes_its_sleepers_sooner() -> None:
    clock = RealClock(speed=0.001)
    sleeper = asyncio.ensure_future(clock.sleep(1.0))  # a quarter of an hour
    await asyncio.sleep(0)
    clock.set_speed(1000.0)
    await asyncio.wait_for(sleeper, 60)
    assert not clock._timers


async def _until(true: Callable[[], bool]) -> None:
    while not true():  # noqa: ASYNC110 - no event says so
        await asyncio.sleep(0)


async def test_longer_work_gives_others_their_turn() -> None:
    clock, loop, done = RealClock(), asyncio.get_running_loop(), list[str]()

    def job(name: str) -> None:
        done.append(name)
        loop.call_soon(done.append, f"after {name}")
        if name == "b":
            raise ZeroDivisionError

    failures: list[object] = []
    loop.set_exception_handler(lambda _, context: failures.append(context["exception"]))
    for name in "abc":
        clock.in_turn(partial(job, name))
    assert not done
    await _until(lambda: "c" in done)
    assert [name for name in done if len(name) == 1] == ["a", "b", "c"]
    assert done.index("after a") < done.index("c")
    assert [type(failure) for failure in failures] == [ZeroDivisionError]  # the next one had its turn all the same


def test_longer_work_is_done_at_once_in_lockstep() -> None:
    done: list[str] = []
    LockstepClock().in_turn(lambda: done.append("a"))
    assert done == ["a"]
