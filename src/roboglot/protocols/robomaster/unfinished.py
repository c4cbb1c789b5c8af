"""Reports a text that waits for its ``;``: to a client that never sends one, the robot seems dead."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from roboglot.protocols.robomaster import limits


class Unfinished:
    """Calls ``report`` when a text has waited UNFINISHED_AFTER for its end; once for each connection."""

    __slots__ = ("_report", "_timer")

    def __init__(self, report: Callable[[], None]) -> None:
        self._report: Callable[[], None] | None = report
        self._timer: asyncio.TimerHandle | None = None

    def note(self, *, waiting: bool) -> None:
        """Wait anew while a text is unfinished, and no longer once it has ended."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if waiting and self._report is not None:
            self._timer = asyncio.get_running_loop().call_later(limits.UNFINISHED_AFTER, self._fire)

    def _fire(self) -> None:
        report, self._report, self._timer = self._report, None, None
        if report is not None:
            report()
