"""Unix time that goes on evenly: what is to last for a while is not ended or prolonged when the clock is set."""

from __future__ import annotations

import time


class SteadyTime:
    """The system's Unix time (s) when it was made, plus the time since, in which the machine may have slept."""

    def __init__(self) -> None:
        self._ahead = time.time() - _uptime()

    def __call__(self) -> float:
        """Return the time, s."""
        return self._ahead + _uptime()


def _uptime() -> float:
    return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic()
