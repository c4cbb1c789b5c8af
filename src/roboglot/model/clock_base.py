"""Interface of every clock of robots; ``model/clock.py`` has the clocks themselves."""

from __future__ import annotations

import asyncio
import math
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Protocol, TypeVar

T = TypeVar("T")
HOLD_MAX = 5.0  # s (machine clock) that lockstep time waits for work outside the event loop


class Timer(Protocol):
    """Something due on the clock that can still be called off."""

    def cancel(self) -> None: ...


class Clock(ABC):
    """Reads and waits for robot time, in seconds.

    ``repeats``: the same inputs give the same trace; nothing may come from chance or from how fast the machine is.
    """

    repeats = False

    @abstractmethod
    def time(self) -> float:
        """Seconds since this clock started; never goes back."""

    @abstractmethod
    def epoch(self) -> float:
        """Calendar time as seconds since 1970-01-01 UTC, running at this clock's pace."""

    @abstractmethod
    def call_at(self, when: float, callback: Callable[[], None]) -> Timer:
        """Call ``callback`` once when ``time()`` has reached ``when``; soon (never inside this call) if it is past."""

    @property
    def turn(self) -> int:
        """Number of timers that have fired in this very instant of a lockstep clock; -1: time passes by itself."""
        return -1

    def arrive(self, happening: Callable[[], None]) -> None:
        """Have something happen that comes from outside. Lockstep robots learn of it when they have come to rest."""
        happening()

    def in_turn(self, job: Callable[[], None], *, first: bool = False) -> None:  # noqa: ARG002 - nothing waits here
        """Do a longer piece of work: at once, or soon where time passes by itself, when others have had their turn.

        ``first``: before all others that wait.
        """
        job()

    def in_steps(self, steps: Iterator[None]) -> None:
        """Take all steps of a piece of work, before all that wait: others have their turn in between, as above."""
        for _ in steps:
            pass

    def hold(self, work: object, seconds: float = HOLD_MAX) -> None:  # noqa: B027 - time that passes waits for nothing
        """Begin ``work`` outside of the event loop (a process, a disk); lockstep time waits until ``release``.

        It waits no longer than so many seconds of the machine.
        """

    def release(self, work: object) -> None:  # noqa: B027
        """End what ``hold`` began; do nothing if it has ended."""

    def reached(self, stamp: float) -> None:  # noqa: B027 - most clocks wait for no world
        """The world has been simulated up to there; inf: there is none any more."""

    @contextmanager
    def holding(self) -> Iterator[None]:
        """Hold while ``with`` lasts."""
        work = object()
        self.hold(work)
        try:
            yield
        finally:
            self.release(work)

    def call_later(self, delay: float, callback: Callable[[], None]) -> Timer:
        """Call ``callback`` once, ``delay`` seconds from now."""
        return self.call_at(self.time() + delay, callback)

    async def sleep_until(self, when: float) -> None:
        """Wait until ``time()`` has reached ``when``."""
        woken: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        def wake() -> None:
            if not woken.done():
                woken.set_result(None)

        timer = self.call_at(when, wake)
        try:
            await woken
        finally:
            timer.cancel()

    async def sleep(self, seconds: float) -> None:
        """Wait ``seconds`` of robot time."""
        await self.sleep_until(self.time() + seconds)

    async def every(self, period: float) -> AsyncIterator[float]:
        """Yield the time every ``period`` seconds from now on, without drift; missed beats are skipped."""
        start, beat = self.time(), 0
        while True:
            beat = max(beat + 1, math.ceil((self.time() - start) / period - 1e-9))
            await self.sleep_until(start + beat * period)
            yield self.time()

    async def wait_for(self, awaitable: Awaitable[T], timeout: float) -> T:
        """The awaitable's result, or TimeoutError after ``timeout`` seconds of robot time (it is cancelled then)."""
        task = asyncio.ensure_future(awaitable)
        waiter = asyncio.current_task()
        cancelled_before = waiter.cancelling() if waiter else 0
        expired = False

        def expire() -> None:
            nonlocal expired
            expired = True
            task.cancel()

        timer = self.call_later(timeout, expire)
        try:
            return await task
        except asyncio.CancelledError:
            # A waiter that is cancelled at the moment of the time-out must not continue.
            if expired and not (waiter and waiter.cancelling() > cancelled_before):
                raise TimeoutError(f"nothing within {timeout} s") from None
            task.cancel()
            raise
        finally:
            timer.cancel()
