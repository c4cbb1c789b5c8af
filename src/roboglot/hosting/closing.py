"""Orderly end of a program's parts, each within a limit."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable

from roboglot.model.errors import RobotError

log = logging.getLogger(__name__)
CLOSE_SECONDS = 0.5  # s for one part to close before it is abandoned


async def close_in_time(name: str, closing: Awaitable[None]) -> None:
    """Wait for ``closing``, at most ``CLOSE_SECONDS`` s; log failures."""
    try:
        await asyncio.wait_for(closing, CLOSE_SECONDS)
    except TimeoutError:
        log.warning("%s did not close in time", name)
    except RobotError as error:
        log.error("cannot close %s cleanly: %s", name, error)
