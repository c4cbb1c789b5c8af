"""A start that a signal ends early, so that Ctrl-C need not wait for it."""

from __future__ import annotations

import asyncio

import pytest

from roboglot.hosting.closing import started


async def test_a_start_is_ended_by_stop() -> None:
    stop, said = asyncio.Event(), list[str]()

    async def start() -> None:
        stop.set()
        try:
            await asyncio.Event().wait()
        finally:
            said.append("ended")

    assert not await started(start(), stop)
    assert said == ["ended"]


async def test_a_start_ends_or_fails_by_itself() -> None:
    async def fail() -> None:
        raise OSError("taken")

    assert await started(asyncio.sleep(0), asyncio.Event())
    with pytest.raises(OSError, match="taken"):
        await started(fail(), asyncio.Event())
    stop = asyncio.Event()
    stop.set()
    assert not await started(fail(), stop)
