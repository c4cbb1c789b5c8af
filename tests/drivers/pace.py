"""Robot time that tests drive, beside threads that keep no robot time: gRPC's."""

import asyncio
import time

LATE_MAX = 0.5  # real s


async def breath(pause: float) -> None:
    """Let other threads have ``pause`` real s; on a busy machine, which is late, ten times of what it was late more."""
    begun = time.monotonic()
    await asyncio.sleep(pause)
    late = time.monotonic() - begun - pause
    if pause and late > pause:
        await asyncio.sleep(min(10 * late, LATE_MAX))
