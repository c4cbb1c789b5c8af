"""Work begun at once: a task only when it waits, with its results, errors and cancellation as in one from the start."""

from __future__ import annotations

import asyncio
from contextvars import ContextVar

import pytest

from roboglot.transport.eager import begin

WHO: ContextVar[str] = ContextVar("who", default="another's")


async def test_work_that_does_not_wait_needs_no_task() -> None:
    done = []

    async def work() -> None:
        WHO.set("the work's")
        done.append(1)

    assert begin(work(), "work") is None
    assert done == [1]
    assert WHO.get() == "another's"


async def test_work_that_waits_goes_on_as_a_task() -> None:
    seen: list[object] = []
    gate: asyncio.Future[str] = asyncio.get_running_loop().create_future()

    async def work() -> None:
        WHO.set("the work's")
        seen.append(await gate)
        await asyncio.sleep(0)
        seen.append(WHO.get())

    task = begin(work(), "work")
    assert task is not None
    assert not seen
    gate.set_result("open")
    await task
    assert seen == ["open", "the work's"]


async def test_errors_come_where_they_happen() -> None:
    async def fails(wait: bool) -> None:
        if wait:
            await asyncio.sleep(0)
        raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        begin(fails(False), "at once")
    task = begin(fails(True), "later")
    assert task is not None
    with pytest.raises(ValueError, match="broken"):
        await task


async def test_cancellation_reaches_the_work() -> None:
    ended = []

    async def work() -> None:
        try:
            await asyncio.get_running_loop().create_future()
        finally:
            ended.append(True)

    task = begin(work(), "work")
    assert task is not None
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert ended == [True]
