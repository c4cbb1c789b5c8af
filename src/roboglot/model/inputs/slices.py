"""Runs longer jobs in slices, between which the event loop serves its sockets. Knows no robot and no clock.

With a slice in every turn of the loop, a request that takes several turns (seven over gRPC) would wait for a slice in
each of them. So after a slice, sockets are served until they have been idle for a moment, long enough for threads to
deliver the next step of a request. Jobs that have waited too long get a slice in every turn.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections import deque
from collections.abc import Callable

SLICE = 0.001  # real s of jobs, after which the loop serves its sockets
SERVING = 0.003  # real s for which sockets may delay the next slice
IDLE = 0.0003  # real s without anything to serve, after which the next slice begins
BEHIND_MAX = 0.2  # real s of waiting jobs, after which sockets delay them no longer
TURN = 0.00005  # real s; longer turns of the loop have served a socket


class Slices:
    """Jobs that wait for their turn. ``speed``: robot s per real s; the higher, the less sockets delay jobs."""

    def __init__(self) -> None:
        self.speed = 1.0
        self._jobs: deque[Callable[[], None]] = deque()
        self._turn: asyncio.Handle | None = None  # of the next slice, or the one under way
        self._ends = self._ended = -math.inf  # real s: of the slice under way, and of the last one
        self._armed = self._served = self._behind = -math.inf  # real s: begin of the turn, of other work, of waiting

    @property
    def over(self) -> bool:
        """True if the slice under way, or the last one, has used up its time."""
        return time.perf_counter() >= self._ends

    def add(self, job: Callable[[], None], *, first: bool) -> None:
        """Run ``job`` after the waiting ones, or (``first``) before them."""
        if first:
            self._jobs.appendleft(job)
        else:
            self._jobs.append(job)
        if self._turn is None:
            self._behind = time.perf_counter()
            self._arm(self._behind)

    def _arm(self, now: float) -> None:
        self._armed = now
        self._turn = asyncio.get_running_loop().call_soon(self._work)

    def _work(self) -> None:
        """Run jobs for one SLICE, unless sockets have just been served."""
        now = time.perf_counter()
        if now >= self._armed + TURN:
            self._served = now
        patience = min(1.0, 1.0 / self.speed)
        if now < min(self._ended + patience * SERVING, self._served + patience * IDLE, self._behind + BEHIND_MAX):
            self._arm(now)
            return
        self._ends = now + SLICE
        try:
            while self._jobs and time.perf_counter() < self._ends:
                self._jobs.popleft()()
        finally:
            self._turn, self._ended = None, time.perf_counter()
            if self._jobs:
                self._arm(self._ended)
