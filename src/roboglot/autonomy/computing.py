"""Long computations: in place in lockstep, so that runs repeat exactly; otherwise in a thread, while time may wait."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TypeVar

from roboglot.model.clock import Clock, LockstepClock

T = TypeVar("T")


async def computed(clock: Clock, work: Callable[[], T]) -> T:
    """Return or raise the result of ``work``."""
    if isinstance(clock, LockstepClock):
        return work()
    with clock.computing():
        return await asyncio.to_thread(work)


def compute_soon(clock: Clock, work: Callable[[], T], then: Callable[[T], None]) -> asyncio.Task[None] | None:
    """Call ``then`` with the result of ``work``: at once in lockstep, otherwise when a thread has computed it."""
    if isinstance(clock, LockstepClock):
        then(work())
        return None

    async def run() -> None:
        then(await computed(clock, work))

    return asyncio.get_running_loop().create_task(run())
