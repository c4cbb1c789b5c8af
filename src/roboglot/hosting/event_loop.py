"""Running coroutines: a command on its event loop, and several until one fails."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Coroutine


def run(work: Coroutine[object, None, None]) -> None:
    """Run ``work`` on uvloop, or on asyncio's own loop in an installation without it."""
    try:
        import uvloop
    except ImportError:
        asyncio.run(work)
    else:
        uvloop.run(work)


async def together(*parts: Awaitable[None]) -> None:
    """Run all until one fails, then cancel the others."""
    tasks = [asyncio.ensure_future(part) for part in parts]
    try:
        await asyncio.gather(*tasks)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
