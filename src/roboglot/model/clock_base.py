"""Interface of all robot clocks, and timers for those of real time; ``model/clock.py`` implements them."""

from __future__ import annotations

import asyncio
import heapq
import itertools
import math
import time
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import contextmanager
from contextvars import Context, copy_context
from typing import Protocol, TypeVar

T = TypeVar("T")
HOLD_MAX = 5.0  # s (machine clock) that lockstep time waits for work outside the event loop
GRAIN = 0.001  # s: the loop's timers are no finer, and may ring as much too early
STRETCH = 0.0015  # real s of timers after which the loop sees to its sockets
CANCELLED_MAX = 64  # timers that were called off and still wait, beside as many that were not


class Timer(Protocol):
    """A pending callback that can be cancelled."""

    def cancel(self) -> None: ...


class Clock(ABC):
    """Reads and waits for robot time, in seconds.

    ``repeats``: the same inputs give the same trace, independent of chance and of the machine's speed. ``behind``:
    robot seconds that a machine that is too slow has cost since the start.
    """

    repeats = False
    behind = 0.0

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

    @property
    def free_until(self) -> float:
        """Time until which nothing is due but the callback under way, or that has passed; -inf: it is unknown."""
        return -math.inf

    @property
    def next_due(self) -> float:
        """Time of the earliest timer, if time passes by itself; else inf."""
        return math.inf

    def go_ahead(self, when: float) -> None:  # noqa: B027 - time passes by itself
        """Let time pass until ``when`` within a callback, which does in advance what it would be called for.

        Not beyond ``free_until``, unless time passes by itself: then it has no effect.
        """

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
    def computing(self) -> Iterator[None]:
        """Compute in a thread inside ``with`` for a robot: time that depends on the machine's speed waits for it."""
        yield

    def holding(self) -> Holding:
        """Hold lockstep time inside ``with``."""
        return Holding(self)

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

    async def keep_calling(self, step: Callable[[], float | None]) -> None:
        """Call ``step`` now, and again as many seconds later as it returns, until it returns None; raise its error.

        As a loop with ``sleep`` in it, at half the cost: the task that waits here is woken at the end only.
        """
        if (seconds := step()) is None:
            return
        ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        context = copy_context()
        timer: Timer

        def again() -> None:
            nonlocal timer
            if ended.done():
                return
            try:
                later = context.run(step)
            except Exception as error:  # noqa: BLE001 - it is the waiting task's
                if not ended.done():
                    ended.set_exception(error)
                    ended.exception()  # known, also if the task is cancelled before it wakes
            else:
                if later is not None:
                    timer = self.call_later(later, again)
                elif not ended.done():  # the step may have cancelled the task
                    ended.set_result(None)

        timer = self.call_later(seconds, again)
        try:
            await ended
        finally:
            timer.cancel()

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


class Holding:
    """Hold of lockstep time inside ``with``."""

    __slots__ = ("_clock",)

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def __enter__(self) -> None:
        self._clock.hold(self)

    def __exit__(self, *_: object) -> None:
        self._clock.release(self)


class RealTimer:
    """One entry; without a callback it has fired or was called off. ``waits``: it is in the heap."""

    __slots__ = ("_timers", "callback", "context", "waits")

    def __init__(self, timers: RealTimers, callback: Callable[[], None]) -> None:
        self._timers = timers
        self.callback: Callable[[], None] | None = callback
        self.context: Context = copy_context()
        self.waits = True

    def cancel(self) -> None:
        if self.callback is not None:
            self.callback = None
            if self.waits:
                self._timers.note_cancelled()


class RealTimers:
    """Timers in one heap, fired by their time, then by their registration; the event loop has one for the earliest.

    With a timer of the loop for each, a robot's hundred waits a second took a tenth of its processor time.
    """

    def __init__(self, wait: Callable[[float], float | None], is_due: Callable[[float], bool]) -> None:
        """``wait``: real s until that robot time, None if the clock stops before; ``is_due``: it has been reached."""
        self._wait, self._is_due = wait, is_due
        self._order = itertools.count()
        self._heap: list[tuple[float, int, RealTimer]] = []
        self._cancelled = 0  # of those in the heap
        self._loop: asyncio.AbstractEventLoop | None = None  # that has the alarm
        self._alarm: asyncio.TimerHandle | None = None
        self._rings_at = 0.0  # robot s
        self._ringing = False

    def __len__(self) -> int:
        return len(self._heap) - self._cancelled

    def add(self, when: float, callback: Callable[[], None]) -> RealTimer:
        """Call ``callback`` once when it is due; soon if it is already."""
        timer = RealTimer(self, callback)
        if math.isnan(when):
            when = -math.inf  # due at once; in the heap, it would stand before all others for good
        heapq.heappush(self._heap, (when, next(self._order), timer))
        if not self._ringing and (
            self._alarm is None or when < self._rings_at or self._loop is not asyncio.get_running_loop()
        ):
            self.arm()
        return timer

    @property
    def next_due(self) -> float:
        """Time of the earliest one; inf if there is none."""
        self._drop_cancelled()
        return self._heap[0][0] if self._heap else math.inf

    def _drop_cancelled(self) -> None:
        """Drop those that were cancelled before the earliest that was not."""
        while self._heap and self._heap[0][2].callback is None:
            heapq.heappop(self._heap)
            self._cancelled -= 1

    def note_cancelled(self) -> None:
        """Count a cancelled timer in the heap; drop all of them once they are the majority."""
        self._cancelled += 1
        if self._cancelled > CANCELLED_MAX and 2 * self._cancelled > len(self._heap):
            self._heap = [entry for entry in self._heap if entry[2].callback is not None]
            heapq.heapify(self._heap)
            self._cancelled = 0

    def arm(self, least: float = 0.0) -> None:
        """Wait for the earliest timer, ``least`` s or more: it is another one, or the clock's pace has changed."""
        if self._alarm is not None:
            self._alarm.cancel()
            self._alarm = None
        self._drop_cancelled()
        if not self._heap:
            return
        self._rings_at = self._heap[0][0]
        if (seconds := self._wait(self._rings_at)) is not None:
            self._loop = asyncio.get_running_loop()
            self._alarm = self._loop.call_later(max(seconds, least), self._ring)

    def _ring(self) -> None:
        """Fire all that are due; what they add comes later, even if it is due as well.

        Those that are left after a STRETCH are fired when the loop has seen to its sockets.
        """
        self._alarm = None
        due = list[tuple[float, int, RealTimer]]()
        while self._heap and self._is_due(self._heap[0][0]):
            entry = heapq.heappop(self._heap)
            entry[2].waits = False
            if entry[2].callback is None:
                self._cancelled -= 1
            else:
                due.append(entry)
        fired, ends = 0, time.perf_counter() + STRETCH
        self._ringing = True
        try:
            for fired, entry in enumerate(due, 1):  # noqa: B007 - after the loop: the number fired
                self._fire(entry[2])
                if time.perf_counter() >= ends:
                    break
        finally:
            self._put_back(due[fired:])
            self._ringing = False
            self.arm(0.0 if due else GRAIN)

    def _put_back(self, entries: list[tuple[float, int, RealTimer]]) -> None:
        for entry in entries:
            if entry[2].callback is not None:
                entry[2].waits = True
                heapq.heappush(self._heap, entry)

    def _fire(self, timer: RealTimer) -> None:
        """Call the timer's callback, unless an earlier one has cancelled it; its error does not affect other timers."""
        callback, timer.callback = timer.callback, None
        if callback is None:
            return
        try:
            timer.context.run(callback)
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:  # noqa: BLE001 - a CancelledError, too, as the loop itself has it
            asyncio.get_running_loop().call_exception_handler(
                {"message": f"Exception in callback {callback!r}", "exception": error}
            )
