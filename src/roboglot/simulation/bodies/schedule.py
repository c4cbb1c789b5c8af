"""Schedule of a robot's parts: each tick calls the parts that are due and on duty. Knows no part."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from roboglot.values import dataclass

CYCLE_MAX = 100  # ticks after which the order of calls repeats at the latest


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


Entry = tuple[Callable[..., None], float, Duty | None]  # function, s since its last call, and its duty


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
    """Calls in the order of ``jobs``; a job's duty is checked when its turn comes.

    The lists of calls for all ticks of a cycle are made once. Equal lists are shared, to save memory: the data of a
    hundred robots must fit into the processor's caches.
    """

    __slots__ = ("_jobs", "_length", "_on", "_rounds", "_start", "changed")

    def __init__(self, jobs: Sequence[Job], tick: float) -> None:
        self._jobs = [_every_tick(job) if CYCLE_MAX % job.every else job for job in jobs]
        self._start = max((job.first for job in self._jobs), default=1)  # from then on the order is periodic
        self._length = self._start + math.lcm(*(job.every for job in self._jobs))
        self.changed: Callable[[], None] | None = None  # called after a duty's change
        lists: dict[tuple[tuple[int, int], ...], list[Entry]] = {}  # by ranks, and ticks since the last call of each
        self._rounds: list[list[Entry]] = []
        for number in range(1, self._length + 1):
            due = [(rank, job) for rank, job in enumerate(self._jobs) if job.due(number)]
            key = tuple((rank, job.first if number == job.first else job.every) for rank, job in due)
            if key not in lists:  # the seconds are summed like the clock's, to the last bit
                lists[key] = [(self._jobs[rank].call, sum([tick] * past), self._jobs[rank].duty) for rank, past in key]
            self._rounds.append(lists[key])
        timings = {(job.first, job.every): rank for rank, job in enumerate(self._jobs) if job.duty is None}
        self._on = {rank: timing for timing, rank in timings.items()}  # by rank; those without a duty once per timing
        for rank, job in enumerate(self._jobs):
            if job.duty is not None:
                job.duty.changed = _Change(self, rank)
                job.duty.changed(job.duty.on)

    def next_after(self, tick: int) -> int:
        """Return the first tick after this one in which something is due; 0: there is none."""
        later = 0
        for first, every in self._on.values():
            at = tick + every - (tick - first) % every if tick >= first else first
            if at < later or not later:
                later = at
        return later

    def _listed(self, tick: int) -> list[Entry]:
        """Return the calls of a tick, counted from 1, also those off duty."""
        at, start = tick - 1, self._start
        return self._rounds[at if at < self._length else start + (at - start) % (self._length - start)]

    def run(self, tick: int) -> None:
        """Call each function that is due with the s since its last call."""
        for call, seconds, duty in self._listed(tick):
            if duty is None or duty.on:
                call(seconds)

    def run_at(self, tick: int, stamp: float) -> None:
        """Call functions that also take the stamp (s)."""
        for call, seconds, duty in self._listed(tick):
            if duty is None or duty.on:
                call(stamp, seconds)

    def change(self, rank: int, on: bool) -> None:
        """Note that a part's duty began or ended."""
        if on:
            self._on[rank] = self._jobs[rank].first, self._jobs[rank].every
        else:
            self._on.pop(rank, None)
        if self.changed is not None:
            self.changed()


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
