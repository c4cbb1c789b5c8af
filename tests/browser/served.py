"""Robot of these tests, and the hosts whose pages a browser shows there."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Robot
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses

ADDRESS = free_addresses(1)
PATIENCE = 60.0  # s of the machine's time
PAGE_PATIENCE = 60_000  # ms of the machine's time until a page shows a change
STRANGER, FRIEND, REBOUND = "evil.example", "studio.example", "rebound.example"


Page = Any
OpenConsole = Callable[..., Awaitable[Page]]


@dataclass(frozen=True, slots=True)
class Served:
    """A robot with all its doors open, and the clock that it runs on."""

    robot: Robot
    clock: LockstepClock
    runtime: Runtime


async def until(page: Any, expression: str) -> None:
    """Wait until an expression holds; Playwright's own way needs eval, which the page's policy forbids."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if await page.evaluate(f"Boolean({expression})"):
            return
        await asyncio.sleep(0.05)
    raise AssertionError(expression)
