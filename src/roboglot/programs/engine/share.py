"""The share of the server's thread that all programs have together: who takes more than a part of it has to wait.

What programs send is read, and what they call is done, in the thread that serves everybody. Time here is the machine's.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable, Coroutine, Generator
from types import coroutine
from typing import TypeVar

T = TypeVar("T")

SHARE_MAX = 0.2
"""Of the server's thread, for all programs together."""
BURST = 0.1
"""Seconds of the share that may be used in advance without waiting; programs still take turns."""
LIGHT_BURST = 0.02
"""Seconds worth of LIGHT that a program may take before it has to queue."""
STEP = 0.0005
"""Seconds of work after which the others get their turn."""
GAP = 0.0005
"""Seconds between two turns, for all other work."""
LIGHT = 0.05
"""Of the server's thread: a program that takes less does not queue, however many others do."""


class Share:
    """``account`` for each program. Those that have taken much queue up, and get turns one after the other."""

    def __init__(self) -> None:
        self._queue: deque[Callable[[], None]] = deque()
        self._timer: asyncio.TimerHandle | None = None
        self._paid_until = self._not_before = 0.0

    def account(self) -> Account:
        """Return the account of a new program."""
        return Account(self)

    def charge(self, seconds: float, now: float) -> None:
        """So much work was done for one of them."""
        self._paid_until = max(self._paid_until, now - BURST) + seconds / SHARE_MAX

    def queue(self, turn: Callable[[], None]) -> None:
        """Call ``turn`` when it is its turn; never at once."""
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
    """Account of one program's time: ``charge`` it, and ``go_on`` with more when it is allowed to."""

    __slots__ = ("_loop", "_paid_until", "_share")

    def __init__(self, share: Share) -> None:
        self._share = share
        self._loop = asyncio.get_running_loop()
        self._paid_until = 0.0

    def charge(self, seconds: float) -> None:
        """So much work was done for it."""
        now = self._loop.time()
        self._share.charge(seconds, now)
        self._paid_until = max(self._paid_until, now - LIGHT_BURST) + seconds / LIGHT

    @property
    def spent(self) -> bool:
        """True if it has to wait for its turn."""
        return self._paid_until > self._loop.time()

    def go_on(self, work: Callable[[], None]) -> None:
        """Do ``work`` now, or when it is this program's turn."""
        if self.spent:
            self.queue(work)
        else:
            work()

    def queue(self, work: Callable[[], None]) -> None:
        """Do ``work`` when it is this program's turn, after everything else that is ready."""

        def turn() -> None:
            self._paid_until = self._loop.time() - STEP / LIGHT  # a step costs nothing
            work()

        self._share.queue(turn)

    async def turn(self) -> None:
        """Wait for one's turn."""
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
        """Pay, and let others have their turn."""
        self.stop()
        await self._account.turn()
        self._begin()

    def stop(self) -> None:
        """Pay."""
        self._account.charge(time.thread_time() - self._began)

    def _begin(self) -> None:
        self._began = time.thread_time()
        self._until = time.perf_counter() + STEP  # a cheaper clock; it does not matter which thread runs here


@coroutine
def metered(work: Coroutine[object, None, T], charge: Callable[[float], None]) -> Generator[object, None, T]:
    """The result of ``work``, charging for what each of its steps takes of the thread."""
    step: Callable[[], object] = lambda: work.send(None)  # noqa: E731 - what comes next depends on how the last wait ended
    try:
        while True:
            began = time.thread_time()
            try:
                awaited = step()
            except StopIteration as stop:
                result: T = stop.value
                return result
            finally:
                charge(time.thread_time() - began)
            try:
                yield awaited
            except BaseException as error:  # noqa: BLE001 - thrown into the work
                thrown = error
                step = lambda: work.throw(thrown)  # noqa: B023, E731
            else:
                step = lambda: work.send(None)  # noqa: E731
    finally:
        work.close()
