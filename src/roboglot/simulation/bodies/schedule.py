"""Schedule of a robot's parts: each tick calls the parts that are due and on duty. Knows no part."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from operator import length_hint

from roboglot.values import dataclass

CYCLE_MAX = 100  # ticks after which the order of calls repeats at the latest
Entry = tuple[int, Callable[..., None], float]  # rank, function, s since its last call


class Duty:
    """Switch of a part, which is called only while it is on (``Part.duty``)."""

    __slots__ = ("changed", "on")

    def __init__(self, *, on: bool = False) -> None:
        self.on = on
        self.changed: Callable[[bool], None] | None = None

    def begin(self) -> None:
        """Switch on: the part is called from now on, in this tick if its turn is still to come."""
        if not self.on:
            self._set(True)

    def end(self) -> None:
        """Switch off: the part is not called any more, but possibly once in this tick."""
        if self.on:
            self._set(False)

    def _set(self, on: bool) -> None:
        self.on = on
        if self.changed is not None:
            self.changed(on)


@dataclass(frozen=True, slots=True)
class Job:
    """One part's call: every ``every`` ticks from tick ``first`` on, while ``duty`` is on (None: always)."""

    call: Callable[..., None]
    every: int = 1
    first: int = 1
    duty: Duty | None = None

    def due(self, tick: int) -> bool:
        """Return whether the job is called in this tick, counted from 1."""
        return tick >= self.first and (tick - self.first) % self.every == 0


class Schedule:
    """Calls in the order of ``jobs``. The lists for all ticks of a cycle are made once, and changed with a duty.

    They share their entries, to need little memory: the data of a hundred robots must fit the caches.
    """

    __slots__ = (
        "_at", "_entries", "_jobs", "_length", "_pass", "_rounds", "_running", "_seconds", "_start", "changed"
    )  # fmt: skip

    def __init__(self, jobs: Sequence[Job], tick: float) -> None:
        self._seconds = tick
        self._jobs = [_every_tick(job) if CYCLE_MAX % job.every else job for job in jobs]
        self._entries: dict[tuple[int, int], Entry] = {}  # by rank and ticks since the last call
        self._start = max((job.first for job in self._jobs), default=1)  # from then on the order is periodic
        self._length = self._start + math.lcm(*(job.every for job in self._jobs))
        self._rounds: list[list[Entry]] = [self._round(tick) for tick in range(1, self._length + 1)]
        self._at = 0
        self._running: list[Entry] = []
        self.changed: Callable[[], None] | None = None  # called after a duty's change
        self._pass: Iterator[Entry] = iter(self._running)
        for rank, job in enumerate(self._jobs):
            if job.duty is not None:
                job.duty.changed = _Change(self, rank)

    def begin(self, tick: int) -> None:
        """Begin a tick, counted from 1; those before it in which nothing is due may be left out."""
        self._at = at = self._place(tick)
        self._running = running = self._rounds[at]
        self._pass = iter(running)

    def due(self, tick: int) -> Iterator[Entry]:
        """Begin a tick and return its calls: rank, function, s since its last call."""
        self.begin(tick)
        return self._pass

    def next_after(self, tick: int) -> int:
        """Return the first tick after this one in which something is due; 0: there is none."""
        rounds, place = self._rounds, self._place(tick + 1)
        for later in range(tick + 1, tick + 1 + self._length):
            if rounds[place]:
                return later
            place = place + 1 if place + 1 < self._length else self._start
        return 0

    def _place(self, tick: int) -> int:
        """Return the place of a tick's list."""
        at, start = tick - 1, self._start
        return at if at < self._length else start + (at - start) % (self._length - start)

    def run(self) -> None:
        """Run the tick that was begun: call each due function with the s since its last call."""
        for _, call, seconds in self._pass:
            call(seconds)

    def run_at(self, stamp: float) -> None:
        """Run it for functions that also take the stamp (s)."""
        for _, call, seconds in self._pass:
            call(stamp, seconds)

    def change(self, rank: int, on: bool) -> None:
        """Update the lists after a part's duty began or ended."""
        for index, entries in enumerate(self._rounds):
            entry = self._entry(rank, index + 1)
            if entry is None:
                continue
            place = bisect_left(entries, rank, key=_rank)
            self._rounds[index] = [*entries[:place], *([entry] if on else ()), *entries[place + (not on) :]]
            if on and index == self._at:
                self._join(entry)
        if self.changed is not None:
            self.changed()

    def _join(self, entry: Entry) -> None:
        """Add an entry to the present tick, unless its turn has passed."""
        place = bisect_left(self._running, entry[0], key=_rank)
        if place >= len(self._running) - length_hint(self._pass):
            self._running.insert(place, entry)

    def _round(self, tick: int) -> list[Entry]:
        ranks = (rank for rank, job in enumerate(self._jobs) if job.duty is None or job.duty.on)
        return [entry for rank in ranks if (entry := self._entry(rank, tick)) is not None]

    def _entry(self, rank: int, tick: int) -> Entry | None:
        job = self._jobs[rank]
        if not job.due(tick):
            return None
        ticks = job.first if tick == job.first else job.every
        entry = self._entries.get((rank, ticks))
        if entry is None:  # the seconds are summed like the clock's, to the last bit
            entry = self._entries[rank, ticks] = rank, job.call, sum([self._seconds] * ticks)
        return entry


def _rank(entry: Entry) -> int:
    return entry[0]


@dataclass(frozen=True, slots=True)
class _Change:
    """Passes a change of a duty on to the schedule."""

    schedule: Schedule
    rank: int

    def __call__(self, on: bool) -> None:
        self.schedule.change(self.rank, on)


def _every_tick(job: Job) -> Job:
    """Return a job that counts its own period, which does not divide a cycle."""
    return Job(_Periodic(job.call, job.every, job.first), duty=job.duty)


class _Periodic:
    """Calls a function every ``every`` ticks, with the time since the last call as its last argument."""

    def __init__(self, call: Callable[..., None], every: int, first: int) -> None:
        self._call, self._every, self._left = call, every, first
        self._since = 0.0

    def __call__(self, *times: float) -> None:
        *stamp, seconds = times
        self._since += seconds
        self._left -= 1
        if not self._left:
            self._left = self._every
            seconds, self._since = self._since, 0.0
            self._call(*stamp, seconds)
