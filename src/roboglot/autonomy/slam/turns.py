"""Scans of one robot, matched in turn with the work of the others in its world. Knows no map."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.clock import Clock
from roboglot.model.events import ScanTaken


class Turns:
    """Calls ``take`` with every scan: at once in lockstep, else in a turn of the loop, before the next scan."""

    __slots__ = ("_clock", "_queued", "_take", "_waiting")

    def __init__(self, clock: Clock, take: Callable[[ScanTaken], None]) -> None:
        self._clock, self._take = clock, take
        self._waiting: ScanTaken | None = None
        self._queued = False

    def put(self, event: ScanTaken) -> None:
        """Queue a scan for this robot's turn; take a waiting one now, so that late turns lose none."""
        self._catch_up()
        self._waiting = event
        if not self._queued:
            self._queued = True
            self._clock.in_turn(self._have_turn)

    def forget(self) -> None:
        """Drop the waiting scan: its place is no longer the robot's."""
        self._waiting = None

    def close(self) -> None:
        """Drop the waiting scan, as the estimator is being closed."""
        self._waiting = None

    def _have_turn(self) -> None:
        self._queued = False
        self._catch_up()

    def _catch_up(self) -> None:
        event, self._waiting = self._waiting, None
        if event is not None:
            self._take(event)
