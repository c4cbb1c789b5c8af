"""External inputs: noted, let in when robots have come to rest, and played instead of asked for."""

from __future__ import annotations

import asyncio
from functools import partial

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.inputs.external import ANSWER, ExternalInputs, Input


@pytest.fixture
def clock() -> LockstepClock:
    return LockstepClock()


async def never() -> str:
    raise AssertionError("no one is asked")


async def test_time_waits_for_an_answer(clock: LockstepClock) -> None:
    inputs, noted = ExternalInputs("a", clock), list[Input]()
    inputs.listen(noted.append)

    async def answered() -> str:
        await asyncio.sleep(0.01)  # of the machine
        return "ok"

    async def ask() -> float:
        assert await inputs.call_out("heartbeat", answered) == "ok"
        return clock.time()

    await clock.advance(1.0)
    asking = asyncio.ensure_future(ask())
    await clock.advance(5.0)
    assert await asking == 1.0
    assert [(one.stamp, one.kind, one.name, one.values) for one in noted] == [
        (1.0, ANSWER, "heartbeat", {"number": 1, "said": "ok"})
    ]


async def test_rerun_makes_no_outside_calls(clock: LockstepClock) -> None:
    inputs = ExternalInputs("a", clock)
    inputs.play()
    asking = asyncio.ensure_future(inputs.call_out("push", never))
    await clock.advance(1.0)
    assert (inputs.waits("push", 1), inputs.waits("push", 2), inputs.waits("close", 1)) == (True, False, False)
    inputs.answer("push", 1, "unavailable")
    assert await asking == "unavailable"


async def test_given_up_call_is_answered_no_more(clock: LockstepClock) -> None:
    inputs = ExternalInputs("a", clock)
    inputs.play()
    with pytest.raises(TimeoutError):
        await asyncio.gather(clock.wait_for(inputs.call_out("push", never), 2.0), clock.advance(3.0))
    assert not inputs.waits("push", 1)


async def test_arrivals_come_one_by_one_at_rest(clock: LockstepClock) -> None:
    said: list[str] = []

    async def busy(name: str) -> None:
        for _ in range(5):
            await asyncio.sleep(0)
        said.append(name)

    tasks = [asyncio.ensure_future(busy("work"))]
    clock.arrive(lambda: tasks.append(asyncio.ensure_future(busy("first"))))
    clock.arrive(lambda: said.append("second"))
    await clock.advance(1.0)
    assert said == ["work", "first", "second"]


async def test_time_stops_between_timers_of_an_instant(clock: LockstepClock) -> None:
    fired: list[int] = []
    for number in range(3):
        clock.call_at(1.0, partial(fired.append, number))
    await clock.advance_to(1.0, 2)
    assert (fired, clock.time(), clock.turn) == ([0, 1], 1.0, 2)
    await clock.advance_to(1.0)
    assert (fired, clock.turn) == ([0, 1, 2], 3)


async def test_consequences_of_an_input_are_no_inputs(clock: LockstepClock) -> None:
    inputs, noted = ExternalInputs("", clock), list[Input]()
    inputs.listen(noted.append)
    with inputs.noting("command", "go", {}):
        assert not inputs.watched
        with inputs.noting("hands", "push", {}):
            pass
    assert [one.name for one in noted] == ["go"]
