"""Keeps an event loop awake while a short answer is expected, as a sleeping process wakes tens of µs late."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Callable

AWAKE = 200e-6  # s of polling after a message: a robot's answer and most clients' next request arrive within it
SHORT_MAX = 2048  # bytes of a request or an answer; larger ones are streams, which tolerate the delay
_make_way: Callable[[], object] = getattr(os, "sched_yield", lambda: None)


class BusyPoll:
    """``stir`` at every message. At 50 messages a second it costs a hundredth of a core, which others may have."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._until = 0.0
        self._stirred = self._polling = False

    def stir(self, size: int) -> None:
        """Stay awake for a while if the message was short."""
        if size <= SHORT_MAX:
            self._stirred = True
            if not self._polling:
                self._polling = True
                self._loop.call_soon(self._poll)

    def _poll(self) -> None:
        """Reschedule itself until the deadline, so that the loop polls without sleeping."""
        now = time.perf_counter()
        if self._stirred:
            self._until, self._stirred = now + AWAKE, False
        if now < self._until:
            _make_way()  # for the client or the robot, if the kernel woke it on this core
            self._loop.call_soon(self._poll)
        else:
            self._polling = False
