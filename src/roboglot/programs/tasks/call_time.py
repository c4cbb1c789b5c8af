"""Robot time of a program's calls in lockstep: those that wait for nothing would take none, and time would stand."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from roboglot.model.clock import Clock

INSTANT_MAX = 20  # calls in one instant
CALL = 0.001  # s a call, about that of a round trip to a real robot


class CallTime:
    """Counts the calls in one instant; further ones wait as long as all of them would have taken on a real robot."""

    def __init__(self, clock: Clock, sleep: Callable[[float], Awaitable[None]]) -> None:
        self._clock, self._sleep = clock, sleep
        self._instant, self._calls = 0.0, 0

    async def begin(self) -> None:
        """Count a call, and wait if there were too many; no effect unless the clock is in lockstep."""
        if not self._clock.repeats:
            return
        if self._clock.time() != self._instant:
            self._instant, self._calls = self._clock.time(), 0
        if self._calls == INSTANT_MAX:
            await self._sleep(INSTANT_MAX * CALL)
            self._instant, self._calls = self._clock.time(), 0
        self._calls += 1
