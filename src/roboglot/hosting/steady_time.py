"""Unix time that setting the clock does not change, for sessions and rights of limited duration."""

from __future__ import annotations

import time


class SteadyTime:
    """Unix time (s) at its creation, plus the elapsed time, sleep of the machine included."""

    def __init__(self) -> None:
        self._ahead = time.time() - uptime()

    def __call__(self) -> float:
        """Return the time, s."""
        return self._ahead + uptime()


def uptime() -> float:
    """Return uptime in s, unaffected by changes of the date, including the machine's sleep."""
    return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic()
