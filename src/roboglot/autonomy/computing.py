"""Where long computations run: in place in lockstep, so that the same happens every time; otherwise in a thread."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TypeVar

from roboglot.model.clock import Clock, LockstepClock

T = TypeVar("T")


async def computed(clock: Clock, work: Callable[[], T]) -> T:
    """What ``work`` returns or raises."""
    if isinstance(clock, LockstepClock):
        return work()
    return await asyncio.to_thread(work)
