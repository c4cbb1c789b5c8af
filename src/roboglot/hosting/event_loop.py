"""The event loop of commands that forward bytes."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine


def run(work: Coroutine[object, None, None]) -> None:
    """Run ``work`` on uvloop, or on asyncio's own loop in an installation without it."""
    try:
        import uvloop
    except ImportError:
        asyncio.run(work)
    else:
        uvloop.run(work)
