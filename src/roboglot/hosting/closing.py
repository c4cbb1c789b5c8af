"""Orderly end of a program's parts, each within a limit."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Coroutine

from roboglot.model.errors import RobotError

log = logging.getLogger(__name__)
CLOSE_SECONDS = 0.5  # s for one part to close before it is abandoned


async def started(starting: Coroutine[None, None, None], stop: asyncio.Event) -> bool:
    """Wait for ``starting``; end it early, and return False, if ``stop`` is set meanwhile."""
    task, stopping = asyncio.ensure_future(starting), asyncio.ensure_future(stop.wait())
    try:
        await asyncio.wait((task, stopping), return_when=asyncio.FIRST_COMPLETED)
    finally:
        stopping.cancel()
        if stop.is_set() or not task.done():
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
    if stop.is_set():
        return False
    await task
    return True


async def close_in_time(name: str, closing: Awaitable[None]) -> None:
    """Wait for ``closing``, at most ``CLOSE_SECONDS`` s; log failures."""
    try:
        await asyncio.wait_for(closing, CLOSE_SECONDS)
    except TimeoutError:
        log.warning("%s did not close in time", name)
    except RobotError as error:
        log.error("cannot close %s cleanly: %s", name, error)
