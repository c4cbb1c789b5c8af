"""A time limit that can be paused. Knows nothing about its owner; times are in the machine's time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable


class Stopwatch:
    """Calls ``over`` once, after running for ``limit`` seconds of the machine in all; 0: never."""

    def __init__(self, limit: float, over: Callable[[], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._left = limit
        self._over = over if limit else None
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Start or continue the stopwatch."""
        if self._over is not None and self._timer is None:
            self._timer = self._loop.call_later(self._left, self._over)

    def stop(self) -> None:
        """Pause the stopwatch."""
        if self._timer is not None:
            self._left = max(0.0, self._timer.when() - self._loop.time())
            self._timer.cancel()
            self._timer = None
