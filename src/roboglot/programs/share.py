"""The share of the server's thread that all programs have together: who takes more than a part of it has to wait.

What programs send is read, and what they call is done, in the thread that serves everybody. Time here is the machine's.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine, Generator
from types import coroutine
from typing import Any, TypeVar

T = TypeVar("T")

SHARE_MAX = 0.3
"""Of the server's thread, for all programs; divided among those that would take more."""
BURST = 0.1
"""Seconds worth of the share that may be taken at once."""
STEP = 0.001
"""Seconds of work after which the others get their turn."""
_LOOK_EVERY = 0.05


class Share:
    """``account`` for each program; they share SHARE_MAX."""

    def __init__(self) -> None:
        self._debtors: set[Account] = set()
        self._looked = 0.0

    def account(self) -> Account:
        """Of a new program."""
        return Account(self)

    def rate(self, account: Account, now: float) -> float:
        """Seconds of work a second for ``account``, which is about to be charged."""
        if now - self._looked > _LOOK_EVERY:
            self._looked = now
            self._debtors = {debtor for debtor in self._debtors if debtor.paid_until > now}
        self._debtors.add(account)
        return SHARE_MAX / len(self._debtors)


class Account:
    """What one program has taken. ``charge`` it; where ``wait`` is above 0 nothing more is done for it meanwhile."""

    __slots__ = ("_loop", "_share", "paid_until")

    def __init__(self, share: Share) -> None:
        self._share = share
        self._loop = asyncio.get_running_loop()
        self.paid_until = 0.0

    def charge(self, seconds: float) -> None:
        """So much work was done for it."""
        now = self._loop.time()
        self.paid_until = max(self.paid_until, now - BURST) + seconds / self._share.rate(self, now)

    @property
    def wait(self) -> float:
        """Seconds until it has paid; 0 or less: it has."""
        return self.paid_until - self._loop.time()

    async def turn(self) -> None:
        """Let the others have their turn, and wait until all is paid."""
        await breath()
        if (wait := self.wait) > 0:
            paid: asyncio.Future[None] = self._loop.create_future()
            timer = self._loop.call_later(wait, lambda: None if paid.done() else paid.set_result(None))
            try:
                await paid
            finally:
                timer.cancel()


class Meter:
    """Charges an account for what is done between two looks."""

    __slots__ = ("_account", "_began")

    def __init__(self, account: Account) -> None:
        self._account = account
        self._began = time.thread_time()

    @property
    def over(self) -> bool:
        """Whether a step's worth of work has been done."""
        return time.thread_time() - self._began > STEP

    async def turn(self) -> None:
        """Pay, and let others have their turn."""
        self.stop()
        await self._account.turn()
        self._began = time.thread_time()

    def stop(self) -> None:
        """Pay."""
        self._account.charge(time.thread_time() - self._began)


@coroutine
def breath() -> Generator[None, None, None]:
    """Everything else that is ready goes first. Takes no robot time."""
    yield


@coroutine
def metered(work: Coroutine[Any, Any, T], charge: Callable[[float], None]) -> Generator[Any, Any, T]:
    """The result of ``work``, charging for what each of its steps takes of the thread."""
    step: Callable[[], Any] = lambda: work.send(None)  # noqa: E731 - what comes next depends on how the last wait ended
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
            except BaseException as error:
                thrown = error
                step = lambda: work.throw(thrown)  # noqa: B023, E731
            else:
                step = lambda: work.send(None)  # noqa: E731
    finally:
        work.close()
