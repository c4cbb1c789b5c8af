"""Limits the share of the server's thread that programs get: a program that takes more has to wait.

The thread that serves all clients also reads the programs' frames and makes their calls. Times are in machine time.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable

SHARE_MAX = 0.2
"""Part of the server's thread for all programs together."""
BURST = 0.1
"""Seconds of the share that may be used in advance without waiting; programs still take turns."""
LIGHT_BURST = 0.02
"""Burst that LIGHT allows a program before it has to queue, s."""
STEP = 0.0005
"""Seconds of work after which the others get their turn."""
GAP = 0.0005
"""Seconds between two turns, for all other work."""
LIGHT = 0.05
"""Part of the server's thread below which a program never queues, even if others do."""


class ThreadShare:
    """Makes an ``account`` for each program. Programs that have used much queue up and get turns one by one."""

    def __init__(self) -> None:
        self._queue: deque[Callable[[], None]] = deque()
        self._timer: asyncio.TimerHandle | None = None
        self._paid_until = self._not_before = 0.0

    def account(self) -> Account:
        """Return the account of a new program."""
        return Account(self)

    def charge(self, seconds: float, now: float) -> None:
        """Count ``seconds`` of work for any program."""
        paid, least = self._paid_until, now - BURST
        self._paid_until = (paid if paid > least else least) + seconds / SHARE_MAX

    def queue(self, turn: Callable[[], None]) -> None:
        """Append ``turn`` to the queue; it is never called at once."""
        self._queue.append(turn)
        if self._timer is None:
            self._set_timer()

    def _set_timer(self) -> None:
        loop = asyncio.get_running_loop()
        self._timer = loop.call_at(max(self._paid_until, self._not_before), self._next)

    def _next(self) -> None:
        now = asyncio.get_running_loop().time()
        self._timer = None
        if self._paid_until <= now:
            self._not_before = now + GAP
            self._queue.popleft()()
        if self._queue and self._timer is None:
            self._set_timer()


class Account:
    """Account of one program's time: ``charge`` work to it; ``go_on`` continues when the program may."""

    __slots__ = ("_loop", "_share", "paid_until")

    def __init__(self, share: ThreadShare) -> None:
        self._share = share
        self._loop = asyncio.get_running_loop()
        self.paid_until = 0.0
        """Time of the loop until which the program has to wait for its turn."""

    def charge(self, seconds: float) -> None:
        """Count ``seconds`` of work for this program."""
        now = self._loop.time()
        self._share.charge(seconds, now)
        paid, least = self.paid_until, now - LIGHT_BURST
        self.paid_until = (paid if paid > least else least) + seconds / LIGHT

    @property
    def spent(self) -> bool:
        """True if the program has to wait for its turn."""
        return self.paid_until > self._loop.time()

    def go_on(self, work: Callable[[], None]) -> None:
        """Do ``work`` now, or when it is this program's turn."""
        if self.spent:
            self.queue(work)
        else:
            work()

    def queue(self, work: Callable[[], None]) -> None:
        """Do ``work`` when it is this program's turn, after everything else that is ready."""

        def turn() -> None:
            self.paid_until = self._loop.time() - STEP / LIGHT  # a step costs nothing
            work()

        self._share.queue(turn)

    async def turn(self) -> None:
        """Wait for this program's turn."""
        granted: asyncio.Future[None] = self._loop.create_future()
        self.queue(lambda: None if granted.done() else granted.set_result(None))
        await granted


class Meter:
    """Charges an account for the work between two checks."""

    __slots__ = ("_account", "_began", "_until")

    def __init__(self, account: Account) -> None:
        self._account = account
        self._begin()

    @property
    def over(self) -> bool:
        """True once a step's worth of time has passed."""
        return time.perf_counter() > self._until

    async def turn(self) -> None:
        """Charge the work so far, and wait for the next turn."""
        self.stop()
        await self._account.turn()
        self._begin()

    def stop(self) -> None:
        """Charge the work so far."""
        self._account.charge(time.thread_time() - self._began)

    def _begin(self) -> None:
        self._began = time.thread_time()
        self._until = time.perf_counter() + STEP  # a cheaper clock, good enough for the end of a step
