"""Clock of a simulated world on a machine that is too slow: time waits."""

from __future__ import annotations

import asyncio
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.clock import COMPUTATION_MAX, HASTE, LEAD, LEAD_MAX, OWED_MAX, PatientClock
from tests.slow_machine import Hours

STEPS = st.tuples(st.sampled_from(["pass", "tick", "pause", "resume", "speed"]), st.floats(0.01, 5.0))


async def test_time_goes_no_further_than_the_world(monkeypatch: pytest.MonkeyPatch) -> None:
    hours = Hours(monkeypatch)
    clock = PatientClock(speed=2.0)
    hours.now += 50.0
    assert clock.time() == pytest.approx(100.0)  # no world has begun yet
    clock.reached(100.0)
    hours.now += LEAD / 4
    assert clock.time() == pytest.approx(100.0 + LEAD / 2)
    hours.now += 1000.0
    assert clock.time() == pytest.approx(100.0 + LEAD)
    clock.reached(200.0)
    assert clock.time() == pytest.approx(100.0 + LEAD)  # it resumes where it stood
    assert clock.behind == pytest.approx(2000.0 - LEAD / 2 - 2.0 * OWED_MAX)
    hours.now += 0.01
    assert clock.time() == pytest.approx(100.0 + LEAD + 0.02 * (1 + HASTE))
    assert clock.real_seconds_until(110.0) == pytest.approx((110.0 - clock.time()) / 2.0 - OWED_MAX + 0.01 * HASTE)
    hours.now += 10.0
    assert clock.time() == pytest.approx(100.0 + LEAD + 20.02 + 2.0 * OWED_MAX)  # what it owed is made up for
    clock.pause()
    now = clock.time()
    hours.now += 1.0
    assert clock.time() == now
    clock.resume()
    clock.reached(math.inf)
    hours.now += 10.0
    assert clock.time() == pytest.approx(now + 20.0)


async def test_timers_wait_with_their_clock() -> None:
    clock = PatientClock(speed=1000.0)
    start = clock.time()
    clock.reached(start)
    sleeper = asyncio.ensure_future(clock.sleep_until(start + 2.5 * LEAD_MAX))
    for step in range(1, 3):
        await asyncio.sleep(0.01)  # ten robot seconds
        assert not sleeper.done()
        clock.reached(start + step * LEAD_MAX)
    await asyncio.wait_for(sleeper, 60)
    assert start + 2.5 * LEAD_MAX <= clock.time() <= start + 3 * LEAD_MAX + 1e-9


async def test_time_waits_for_computations(monkeypatch: pytest.MonkeyPatch) -> None:
    hours = Hours(monkeypatch)
    clock = PatientClock(speed=6.0)
    with clock.computing():
        hours.now += 0.01
        with clock.computing():
            hours.now += 10.0
            assert clock.time() == pytest.approx(COMPUTATION_MAX)
        hours.now += 10.0
        assert clock.time() == pytest.approx(COMPUTATION_MAX)  # the first goes on
    hours.now += 0.001
    assert COMPUTATION_MAX < clock.time() <= COMPUTATION_MAX + 0.006 * (1 + HASTE) + 1e-9
    assert clock.behind == pytest.approx(20.01 * 6.0 - COMPUTATION_MAX - OWED_MAX * 6.0)


async def test_a_thought_that_hangs_holds_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roboglot.model.clock.HUNG_AFTER", 0.01)
    clock = PatientClock(speed=1000.0)
    with clock.computing():
        await asyncio.wait_for(clock.sleep(2.0), 60)


@given(steps=st.lists(STEPS, max_size=40))
def test_time_never_goes_back_nor_is_invented(steps: list[tuple[str, float]]) -> None:
    with pytest.MonkeyPatch.context() as monkeypatch:
        hours = Hours(monkeypatch)
        clock = PatientClock()
        clock.reached(0.0)
        world = before = asked = 0.0
        for what, value in steps:
            match what:
                case "pass":
                    hours.now += value
                    asked += 0.0 if clock.paused else value * clock.speed
                case "tick":
                    world = clock.time()
                    clock.reached(world)
                case "pause":
                    clock.pause()
                case "resume":
                    clock.resume()
                case "speed":
                    clock.set_speed(value)
            now = clock.time()
            assert before - 1e-9 <= now <= min(world + LEAD_MAX, asked) + 1e-9
            assert now + clock.behind <= asked + 1e-9
            before = now
