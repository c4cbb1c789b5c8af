"""Robot time: real, scaled (xN) or lockstep. All robot code waits and reads the time here only.

``time()`` is seconds since the robot's clock started; ``epoch()`` the calendar time that belongs to it. A lockstep
clock stands still until ``advance`` is called; the same program on it gives the same trace, byte for byte.
"""

from __future__ import annotations

import asyncio
import gc
import heapq
import itertools
import math
import time
from collections import deque
from collections.abc import Callable, Iterator, Sized
from contextlib import contextmanager
from contextvars import copy_context
from functools import partial

from roboglot.model.clock_base import HOLD_MAX, Clock, RealTimers, Timer
from roboglot.model.inputs.slices import Slices

__all__ = ["LOCKSTEP_EPOCH", "Clock", "LockstepClock", "PatientClock", "RealClock", "Timer"]
YIELD_AFTER = 0.5  # s of lockstep time
ROUNDS_MAX = 200  # of the event loop
LEAD, LEAD_MAX = 0.03, 0.1  # robot s by which a patient clock may be ahead of the world, at 1 x and at great speeds
LEAD_REAL = 0.002  # real s that the lead must last: timers are no finer than half of that
COMPUTATION_MAX = 0.5  # robot s that a robot's computation takes at most
HUNG_AFTER = 60.0  # real s that time waits for a computation
HASTE = 0.25  # share by which a patient clock runs faster after it stood still
OWED_MAX = 0.5  # real s that it makes up for at most
STANDING = 0.002  # real s between two checks of a patient clock that stands still
LOCKSTEP_EPOCH = 1_767_225_600.0  # 2026-01-01T00:00:00Z: lockstep traces contain no real date


class RealClock(Clock):
    """Real time multiplied by ``speed``; can be paused, stepped and sped up or slowed down while it runs.

    While it is paused, no timer fires and ``time()`` stands still: robots and world are frozen, doors still answer.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._anchor = time.monotonic(), 0.0  # a real instant and the corresponding robot time
        self._epoch = time.time()
        self._until = math.inf  # robot time at which the clock stops
        self._timers = RealTimers(self.real_seconds_until, self._is_due)
        self._speed = 1.0
        self._slices = Slices()
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

    @property
    def free_until(self) -> float:
        return self.time()

    @property
    def next_due(self) -> float:
        return self._timers.next_due

    def epoch(self) -> float:
        return self._epoch + self.time()

    def call_at(self, when: float, callback: Callable[[], None]) -> Timer:
        return self._timers.add(when, callback)

    def in_turn(self, job: Callable[[], None], *, first: bool = False) -> None:
        self._slices.add(partial(copy_context().run, job), first=first)

    def in_steps(self, steps: Iterator[None]) -> None:
        for _ in steps:
            if self._slices.over:
                self.in_turn(partial(self.in_steps, steps), first=True)
                return

    def set_speed(self, speed: float) -> None:
        """Run ``speed`` times as fast as real time from now on. Raises ValueError unless it is above 0."""
        if not 0 < speed < math.inf:
            raise ValueError(f"the speed of a clock must be above 0, not {speed}")
        self._change(speed, self._until)

    def pause(self) -> None:
        """Stop time until ``resume`` or ``step``."""
        self._change(self._speed, self.time())

    def resume(self) -> None:
        """Let time run again."""
        self._change(self._speed, math.inf)

    def step(self, seconds: float) -> None:
        """Let ``seconds`` pass from now, at the clock's speed, and pause. Raises ValueError if negative."""
        if not 0 <= seconds < math.inf:
            raise ValueError("time does not go back")
        self._change(self._speed, self.time() + seconds)

    def real_seconds_until(self, when: float) -> float | None:
        """Return the real seconds until robot time ``when``; None if the clock stops before."""
        if when > self._until:
            return None
        return max(0.0, when - self.time()) / self._speed

    def real_time_of(self, stamp: float) -> float:
        """Return the ``time.monotonic`` instant of robot time ``stamp``, at the current pace."""
        real, robot = self._anchor
        return real + (stamp - robot) / self._speed

    def _is_due(self, when: float) -> bool:
        return self.time() >= when

    def _change(self, speed: float, until: float) -> None:
        self._anchor = time.monotonic(), self.time()
        self._speed, self._until = speed, until
        self._slices.speed = speed
        self._timers.arm()


class PatientClock(RealClock):
    """A real clock that waits for the world and for what robots compute: on a slow machine robot time falls behind.

    It may be ahead of the world by LEAD to LEAD_MAX, and of a computation by COMPUTATION_MAX. After it stood still,
    it runs faster by HASTE to make up for up to OWED_MAX; any more is lost, and counted in ``behind``. Until the first
    call of ``reached`` it does not wait for the world.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._reach = self._limit = math.inf  # robot time that the world allows; at which the clock stands still
        self._computations: dict[object, float] = {}  # robot time that each allows
        self._owed = 0.0  # robot s at the anchor
        super().__init__(speed)

    def time(self) -> float:
        now = self._wanted(time.monotonic())
        return now if now < self._limit else self._limit

    def _wanted(self, real: float) -> float:
        """Return robot time as if the clock waited for nothing."""
        (anchor, robot), owed = self._anchor, self._owed
        passed = (real - anchor) * self._speed
        now = robot + passed
        if owed:
            now += min(owed, passed * HASTE)
        return now if now < self._until else self._until

    def reached(self, stamp: float) -> None:
        self._reach = stamp + min(max(LEAD, self._speed * LEAD_REAL), LEAD_MAX)
        self._wait_anew()

    @contextmanager
    def computing(self) -> Iterator[None]:
        computation = object()
        self._computations[computation] = self.time() + COMPUTATION_MAX
        self._wait_anew()
        hung = asyncio.get_running_loop().call_later(HUNG_AFTER, self._forget, computation)
        try:
            yield
        finally:
            hung.cancel()
            self._forget(computation)

    def _forget(self, computation: object) -> None:
        if self._computations.pop(computation, None) is not None:
            self._wait_anew()

    def _wait_anew(self) -> None:
        """Note the time that the clock stood still at its limit, and set the next limit."""
        now, (real, robot) = time.monotonic(), self._anchor
        if self._wanted(now) > self._limit:
            owed = min(robot + (now - real) * self._speed + self._owed, self._until) - self._limit
            self._anchor, self._owed = (now, self._limit), min(owed, OWED_MAX * self._speed)
            self.behind += owed - self._owed
        self._limit = min(self._reach, *self._computations.values(), math.inf)

    def real_seconds_until(self, when: float) -> float | None:
        if when > self._until:
            return None
        (real, _), now = self._anchor, self.time()
        if now >= self._limit < when:
            return STANDING
        wait = max(0.0, when - now)
        # Robot time that is still made up for: the clock runs faster by HASTE until it is, then as usual.
        owed = max(0.0, self._owed - (time.monotonic() - real) * self._speed * HASTE)
        return max(wait - owed, wait / (1.0 + HASTE)) / self._speed

    def _change(self, speed: float, until: float) -> None:
        self._wait_anew()
        super()._change(speed, until)
        self._owed = 0.0


class _LockstepTimer:
    """One entry of the lockstep heap."""

    __slots__ = ("callback",)

    def __init__(self, callback: Callable[[], None]) -> None:
        self.callback: Callable[[], None] | None = callback

    def cancel(self) -> None:
        self.callback = None


class LockstepClock(Clock):
    """Time that passes only in ``advance``; callbacks run in the order of their time, then of their registration.

    Needs asyncio's own event loop or uvloop: after each instant it waits until the loop has nothing ready to run.
    Sockets are not waited for: code that uses one awaits the reply itself.
    Work announced by ``hold`` is waited for, at most HOLD_MAX seconds each. What ``arrive`` brings happens when
    nothing is ready to run any more, one after the other; at rest after ROUNDS_MAX rounds of the loop at the latest.
    """

    repeats = True

    def __init__(self) -> None:
        self._now = 0.0
        self._held: dict[object, float] = {}  # until when, by the loop's clock
        self._released: asyncio.Future[None] | None = None
        self._order = itertools.count()
        self._heap: list[tuple[float, int, _LockstepTimer]] = []
        self._turn = 0
        self._arrived: deque[Callable[[], None]] = deque()
        self._letting_in: asyncio.Task[None] | None = None
        self._advancing = False
        self._ready: Sized = ()  # what the loop has ready to run
        self._end = -math.inf  # until which the present callback may go ahead, if no other is due before

    def time(self) -> float:
        return self._now

    @property
    def free_until(self) -> float:
        if self._ready or self._held or self._arrived:
            return -math.inf
        while self._heap and self._heap[0][2].callback is None:
            heapq.heappop(self._heap)
        return min(self._end, math.nextafter(self._heap[0][0], -math.inf)) if self._heap else self._end

    def go_ahead(self, when: float) -> None:
        if when > self._now:
            self._set(when)
            self._turn = 1

    @property
    def turn(self) -> int:
        return self._turn

    def epoch(self) -> float:
        return LOCKSTEP_EPOCH + self._now

    def call_at(self, when: float, callback: Callable[[], None]) -> Timer:
        timer = _LockstepTimer(partial(copy_context().run, callback))
        heapq.heappush(self._heap, (max(when, self._now), next(self._order), timer))
        return timer

    async def advance(self, seconds: float) -> None:
        """Let ``seconds`` pass; all due callbacks and their consequences run before the next instant."""
        await self.advance_to(self._now + seconds)

    async def advance_to(self, end: float, turn: int = -1) -> None:
        """Let time pass until exactly ``end``; with ``turn``, only until so many timers have fired in that instant."""
        if end < self._now:
            raise ValueError("time does not go back")
        if self._letting_in is not None:
            await asyncio.wait((self._letting_in,))
        self._advancing, self._ready = True, _ready()
        try:
            await asyncio.sleep(0)
            await self._settle()
            await self._fire(end, turn)
        finally:
            self._advancing, self._end = False, -math.inf
        self._set(max(self._now, end))

    async def _fire(self, end: float, turn: int) -> None:
        yielded = self._now
        ready, limit = self._ready, end if turn >= 0 else end + 1e-9
        self._end = math.nextafter(end, -math.inf) if turn >= 0 else limit
        while self._heap and self._heap[0][0] <= limit:
            when, _, timer = self._heap[0]
            callback = timer.callback
            last = turn >= 0 and callback is not None and max(when, self._now) == end
            if last and turn <= (self._turn if self._now == end else 0):
                break
            heapq.heappop(self._heap)
            if callback is None:
                continue
            if when > self._now:
                self._now, self._turn = when, 0
            self._turn += 1
            callback()
            if ready or self._held or self._arrived:  # the usual case: nothing to run
                await self._settle()
            if self._now - yielded >= YIELD_AFTER:  # callbacks may keep becoming ready; let sockets be polled
                yielded = self._now
                await asyncio.sleep(0)

    def _set(self, now: float) -> None:
        if now != self._now:
            self._now, self._turn = now, 0

    async def _settle(self) -> None:
        """Yield until no callback of the loop is ready and all outside events have been handled."""
        while self._ready or self._held or self._arrived:
            if self._ready:
                await asyncio.sleep(0)
            elif self._arrived:
                self._arrived.popleft()()
            else:
                await self._wait_for_work()

    def arrive(self, happening: Callable[[], None]) -> None:
        self._arrived.append(happening)
        if self._advancing:
            self._wake()
        elif self._letting_in is None:
            self._letting_in = asyncio.get_running_loop().create_task(self._let_in(), name="lockstep")

    async def _let_in(self) -> None:
        """Admit outside events while time stands still."""
        ready = _ready()
        try:
            while self._arrived:
                for _ in range(ROUNDS_MAX):
                    await asyncio.sleep(0)
                    if not ready:
                        break
                self._arrived.popleft()()
        finally:
            self._letting_in = None

    def hold(self, work: object, seconds: float = HOLD_MAX) -> None:
        self._held[work] = asyncio.get_running_loop().time() + seconds

    def release(self, work: object) -> None:
        if self._held.pop(work, None) is not None:
            self._wake()

    async def _wait_for_work(self) -> None:
        """Wait until some of the held work has ended; drop work that took too long."""
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


def _ready() -> Sized:
    """Return the running loop's queue of ready callbacks, the only deque that uvloop's has."""
    loop = asyncio.get_running_loop()
    for part in (getattr(loop, "_ready", None), *gc.get_referents(loop)):
        if isinstance(part, deque):
            return part
    raise RuntimeError("a lockstep clock needs asyncio's own event loop or uvloop")
