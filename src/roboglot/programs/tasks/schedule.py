"""Schedule of tasks by the robot's clock: one timer, always for the earliest task. Knows ids and times."""

from __future__ import annotations

import heapq
from collections.abc import Callable

from roboglot.model.clock import Clock, Timer

LOOK_AFTER = 3600.0  # s; distant times are checked again, so that no timer exceeds what the loop supports

STALE_MAX = 64  # obsolete entries


class Schedule:
    """Calls ``fire(id, due)`` once when the clock's calendar has reached ``due``, the earliest first."""

    def __init__(self, clock: Clock, fire: Callable[[str, float], None]) -> None:
        self._clock = clock
        self._fire = fire
        self._due: dict[str, float] = {}
        self._heap: list[tuple[float, str]] = []
        self._timer: Timer | None = None

    def set(self, id: str, due: float) -> None:
        """Schedule ``id`` for ``due`` (Unix s), in place of any earlier time; a past time fires soon."""
        self._due[id] = due
        heapq.heappush(self._heap, (due, id))
        if len(self._heap) > 2 * len(self._due) + STALE_MAX:
            self._heap = [(due, id) for id, due in self._due.items()]
            heapq.heapify(self._heap)
        self._arm()

    def drop(self, id: str) -> None:
        """Drop an entry."""
        self._due.pop(id, None)

    def clear(self) -> None:
        """Drop all entries."""
        self._due.clear()
        self._heap.clear()
        self._arm()

    def _arm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        while self._heap and self._due.get(self._heap[0][1]) != self._heap[0][0]:
            heapq.heappop(self._heap)  # removed or rescheduled
        if self._heap:
            left = self._heap[0][0] - self._clock.epoch()
            self._timer = self._clock.call_later(min(max(0.0, left), LOOK_AFTER), self._look)

    def _look(self) -> None:
        self._timer = None
        now = self._clock.epoch() + 1e-6  # rounding of large Unix times: a timer can fire this much early
        while self._heap and self._heap[0][0] <= now:
            due, id = heapq.heappop(self._heap)
            if self._due.get(id) == due:
                del self._due[id]
                self._fire(id, due)
        self._arm()
