"""Robot of these tests, and the hosts whose pages a browser shows there."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from roboglot.console.teleop import PAD
from roboglot.model.action import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Robot
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses

ADDRESS = free_addresses(1)
PATIENCE = 60.0  # s of the machine's time
PAGE_PATIENCE = 60_000  # ms of the machine's time until a page shows a change
STILL = {"reduced_motion": "reduce"}  # no colour is seen halfway to another
STRANGER, FRIEND, REBOUND = "evil.example", "studio.example", "rebound.example"


Page = Any
OpenConsole = Callable[..., Awaitable[Page]]


@dataclass(frozen=True, slots=True)
class Served:
    """A robot with all its doors open, and the clock that it runs on."""

    robot: Robot
    clock: LockstepClock
    runtime: Runtime


async def becomes(read: Callable[[], Awaitable[object]], wanted: object) -> None:
    """Wait until ``read`` returns what is wanted: a page shows a change when it comes to it."""
    end = time.monotonic() + PATIENCE
    while (found := await read()) != wanted:
        if time.monotonic() > end:
            assert found == wanted
        await asyncio.sleep(0.05)


async def shows(page: Page, expression: str, wanted: object) -> None:
    """Wait until an expression has this value in a page."""
    await becomes(lambda: page.evaluate(expression), wanted)


def is_driven(robot: Robot) -> bool:
    """Return True while something moves the robot, or is to."""
    return any(action.status is ActionStatus.EXECUTING for action in robot.actions.running())


async def drive_until(robot: Robot, clock: LockstepClock, enough: Callable[[], bool]) -> None:
    """Let time pass while a page's pad drives: a piece for each of its commands, shorter than these last."""
    commanded = asyncio.Event()
    deafen = robot.outside.listen(lambda given: commanded.set() if (given.kind, given.name) == (PAD, "move") else None)
    try:
        async with asyncio.timeout(PATIENCE):
            while not enough():
                commanded.clear()
                await commanded.wait()
                await clock.advance(0.08)
    finally:
        deafen()


async def until(page: Page, expression: str) -> None:
    """Wait until an expression holds; Playwright's own way needs eval, which the page's policy forbids."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if await page.evaluate(f"Boolean({expression})"):
            return
        await asyncio.sleep(0.05)
    raise AssertionError(expression)
