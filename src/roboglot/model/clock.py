"""Robot time: real, scaled (xN) or lockstep. All robot code waits and reads the time here and nowhere else.

``time()`` is seconds since the robot's clock started; ``epoch()`` the calendar time that belongs to it. A lockstep
clock stands still until ``advance`` is called; the same program on it gives the same trace, byte for byte.
"""

from __future__ import annotations

import asyncio
import heapq
import itertools
import math
import time
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Sized
from contextlib import contextmanager
from contextvars import copy_context
from functools import partial
from typing import Protocol, TypeVar

T = TypeVar("T")
YIELD_AFTER = 0.5  # s of lockstep time
HOLD_MAX = 5.0  # s of the machine that lockstep time waits for work outside of the event loop
LEAD = 0.1  # s that a patient clock goes further than the world
STANDING = 0.002  # real s between two looks at a patient clock that stands still
LOCKSTEP_EPOCH = 1_767_225_600.0  # 2026-01-01T00:00:00Z: lockstep traces carry no real date


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

    def hold(self, work: object) -> None:  # noqa: B027 - time that passes by itself waits for nothing
        """Begin ``work`` outside of the event loop (a process, a disk); lockstep time waits until ``release``."""

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
            # A waiter that is cancelled in the very moment of the time-out must not go on.
            if expired and not (waiter and waiter.cancelling() > cancelled_before):
                raise TimeoutError(f"nothing within {timeout} s") from None
            task.cancel()
            raise
        finally:
            timer.cancel()


class _RealTimer:
    """One entry of a real clock; armed in the event loop while the clock runs."""

    __slots__ = ("_armed", "_callback", "_clock", "when")

    def __init__(self, clock: RealClock, when: float, callback: Callable[[], None]) -> None:
        self._clock, self.when, self._callback = clock, when, callback
        self._armed: asyncio.TimerHandle | None = None
        self.arm()

    def arm(self) -> None:
        """Wait anew: the pace of the clock has changed."""
        if self._armed is not None:
            self._armed.cancel()
        delay = self._clock.real_seconds_until(self.when)
        self._armed = None if delay is None else asyncio.get_running_loop().call_later(delay, self._fire)

    def cancel(self) -> None:
        self._clock.forget(self)
        if self._armed is not None:
            self._armed.cancel()

    def _fire(self) -> None:
        if self._clock.late(self.when):
            self.arm()
            return
        self._clock.forget(self)
        self._callback()


class RealClock(Clock):
    """Time as it passes outside, times ``speed``. It can be paused, stepped and made faster or slower while it runs.

    While it is paused nothing falls due and ``time()`` stands still: the robots and their world are frozen, the
    doors go on answering.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._anchor = time.monotonic(), 0.0  # a real instant and the robot time that belonged to it
        self._epoch = time.time()
        self._until = math.inf  # robot time at which the clock stops
        self._timers: set[_RealTimer] = set()
        self._speed = 1.0
        self.set_speed(speed)

    @property
    def speed(self) -> float:
        """Robot seconds per real second while the clock runs."""
        return self._speed

    @property
    def paused(self) -> bool:
        """True while robot time stands still."""
        return self.time() >= self._until

    def time(self) -> float:
        real, robot = self._anchor
        return min(robot + (time.monotonic() - real) * self._speed, self._until)

    def epoch(self) -> float:
        return self._epoch + self.time()

    def call_at(self, when: float, callback: Callable[[], None]) -> Timer:
        timer = _RealTimer(self, when, callback)
        self._timers.add(timer)
        return timer

    def set_speed(self, speed: float) -> None:
        """Run ``speed`` times as fast as real time from now on. Raises ValueError unless it is above 0."""
        if not 0 < speed < math.inf:
            raise ValueError(f"the speed of a clock is above 0, not {speed}")
        self._change(speed, self._until)

    def pause(self) -> None:
        """Let time stand still until ``resume`` or ``step``."""
        self._change(self._speed, self.time())

    def resume(self) -> None:
        """Let time pass."""
        self._change(self._speed, math.inf)

    def step(self, seconds: float) -> None:
        """Let ``seconds`` pass from now, at the clock's speed, and pause. Raises ValueError for less than nothing."""
        if not 0 <= seconds < math.inf:
            raise ValueError("time does not go back")
        self._change(self._speed, self.time() + seconds)

    def real_seconds_until(self, when: float) -> float | None:
        """Return the real seconds until robot time ``when``; None if the clock stops before."""
        if when > self._until:
            return None
        return max(0.0, when - self.time()) / self._speed

    def real_time_of(self, stamp: float) -> float:
        """Return the instant of ``time.monotonic`` at which robot time was ``stamp``, at the pace of now."""
        real, robot = self._anchor
        return real + (stamp - robot) / self._speed

    def late(self, _when: float) -> bool:
        """Return whether the clock stood still since a timer for then was armed, so that it is not yet due."""
        return False

    def forget(self, timer: _RealTimer) -> None:
        """Drop a timer that fired or was cancelled."""
        self._timers.discard(timer)

    def _change(self, speed: float, until: float) -> None:
        self._anchor = time.monotonic(), self.time()
        self._speed, self._until = speed, until
        for timer in tuple(self._timers):
            timer.arm()


class PatientClock(RealClock):
    """A real clock that waits for the world: a machine that is too slow makes time pass later, and loses none of it.

    It goes LEAD further than the world at most. Until ``reached`` is called first it waits for nothing.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._reach = math.inf
        super().__init__(speed)

    def time(self) -> float:
        return min(super().time(), self._reach)

    def reached(self, stamp: float) -> None:
        if super().time() > self._reach:  # it stood there, and goes on from there
            self._anchor = time.monotonic(), self._reach
        self._reach = stamp + LEAD

    def late(self, when: float) -> bool:
        return self.time() < when

    def real_seconds_until(self, when: float) -> float | None:
        seconds = super().real_seconds_until(when)
        return None if seconds is None else max(seconds, STANDING if self.time() >= self._reach < when else 0.0)


class _LockstepTimer:
    """One entry of the lockstep heap."""

    __slots__ = ("callback",)

    def __init__(self, callback: Callable[[], None]) -> None:
        self.callback: Callable[[], None] | None = callback

    def cancel(self) -> None:
        self.callback = None


class LockstepClock(Clock):
    """Time that passes only in ``advance``; callbacks run in the order of their time, then of their registration.

    Needs asyncio's own event loop: after each instant it waits until the loop has nothing ready to run, and only that
    loop lets us see it (uvloop does not). Sockets are not waited for: code that uses one awaits the reply itself.
    What ``hold`` has announced is waited for, at most HOLD_MAX seconds each.
    """

    repeats = True

    def __init__(self) -> None:
        self._now = 0.0
        self._held: dict[object, float] = {}  # until when, on the loop's clock
        self._released: asyncio.Future[None] | None = None
        self._order = itertools.count()
        self._heap: list[tuple[float, int, _LockstepTimer]] = []

    def time(self) -> float:
        return self._now

    def epoch(self) -> float:
        return LOCKSTEP_EPOCH + self._now

    def call_at(self, when: float, callback: Callable[[], None]) -> Timer:
        timer = _LockstepTimer(partial(copy_context().run, callback))
        heapq.heappush(self._heap, (max(when, self._now), next(self._order), timer))
        return timer

    async def advance(self, seconds: float) -> None:
        """Let ``seconds`` pass: every due callback runs, and all that follows from it, before the next instant."""
        await self.advance_to(self._now + seconds)

    async def advance_to(self, end: float) -> None:
        """Let time pass until exactly ``end``."""
        if end < self._now:
            raise ValueError("time does not go back")
        await asyncio.sleep(0)
        ready = _ready_of(asyncio.get_running_loop())
        await self._settle(ready)
        yielded = self._now
        while self._heap and self._heap[0][0] <= end + 1e-9:
            when, _, timer = heapq.heappop(self._heap)
            if (callback := timer.callback) is None:
                continue
            self._now = max(self._now, when)
            callback()
            if ready or self._held:  # mostly there is nothing
                await self._settle(ready)
            if self._now - yielded >= YIELD_AFTER:  # nothing else may have been ready for long; sockets want a turn
                yielded = self._now
                await asyncio.sleep(0)
        self._now = max(self._now, end)

    async def _settle(self, ready: Sized) -> None:
        """Give way until no other callback of the loop is ready."""
        while ready or self._held:
            if ready:
                await asyncio.sleep(0)
            else:
                await self._wait_for_work()

    def hold(self, work: object) -> None:
        self._held[work] = asyncio.get_running_loop().time() + HOLD_MAX

    def release(self, work: object) -> None:
        if self._held.pop(work, None) is not None:
            self._wake()

    async def _wait_for_work(self) -> None:
        """Wait until some of it has ended, or has taken too long: that no longer counts."""
        loop = asyncio.get_running_loop()
        self._released = loop.create_future()
        timer = loop.call_at(min(self._held.values()), self._wake)
        try:
            await self._released
        finally:
            timer.cancel()
        now = loop.time()
        self._held = {work: until for work, until in self._held.items() if until > now}

    def _wake(self) -> None:
        if self._released is not None and not self._released.done():
            self._released.set_result(None)


def _ready_of(loop: asyncio.AbstractEventLoop) -> Sized:
    """The callbacks that the loop will run next, as they are at any time."""
    ready: Sized | None = getattr(loop, "_ready", None)
    if ready is None:
        raise RuntimeError("a lockstep clock needs asyncio's own event loop")
    return ready
