"""Interface of all robot clocks; ``model/clock.py`` implements them."""

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
    """A pending callback that can be cancelled."""

    def cancel(self) -> None: ...


class Clock(ABC):
    """Reads and waits for robot time, in seconds.

    ``repeats``: the same inputs give the same trace, independent of chance and of the machine's speed.
    """

    repeats = False

    @abstractmethod
    def time(self) -> float:
        """Return seconds since this clock started; monotonic."""

    @abstractmethod
    def epoch(self) -> float:
        """Return calendar time, s since 1970-01-01 UTC, at this clock's pace."""

    @abstractmethod
    def call_at(self, when: float, callback: Callable[[], None]) -> Timer:
        """Call ``callback`` once when ``time()`` has reached ``when``; soon (never inside this call) if it is past."""

    @property
    def turn(self) -> int:
        """Number of timers that have fired in this very instant of a lockstep clock; -1: time passes by itself."""
        return -1

    def arrive(self, happening: Callable[[], None]) -> None:
        """Handle an outside event; lockstep robots learn of it when they have come to rest."""
        happening()

    def in_turn(self, job: Callable[[], None], *, first: bool = False) -> None:  # noqa: ARG002 - nothing waits here
        """Run a longer job: at once in lockstep, otherwise soon, after other jobs have had their turn.

        ``first``: before all others that wait.
        """
        job()

    def in_steps(self, steps: Iterator[None]) -> None:
        """Run all steps of a job ahead of waiting ones; others get their turn between steps, as above."""
        for _ in steps:
            pass

    def hold(self, work: object, seconds: float = HOLD_MAX) -> None:  # noqa: B027 - time that passes waits for nothing
        """Begin ``work`` outside of the event loop (a process, a disk); lockstep time waits until ``release``.

        It waits at most ``seconds`` of real time.
        """

    def release(self, work: object) -> None:  # noqa: B027
        """End work announced by ``hold``; no effect if it has ended."""

    def reached(self, stamp: float) -> None:  # noqa: B027 - most clocks wait for no world
        """Report that the world has been simulated up to ``stamp``; inf: the world is gone."""

    @contextmanager
    def holding(self) -> Iterator[None]:
        """Hold lockstep time inside ``with``."""
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
        """Return the result; after ``timeout`` s of robot time cancel the awaitable and raise TimeoutError."""
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
