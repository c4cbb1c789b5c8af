"""The log of a run: whole lines, as fast as the program's share of the server and the log's readers allow."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable

from roboglot.model.clock import Clock
from roboglot.programs.engine.events import ExitReason
from roboglot.programs.engine.run import Run
from roboglot.programs.engine.share import Meter
from roboglot.programs.stores import LOG_MAX, LOG_TEXT_MAX, LogEntry
from roboglot.programs.tasks.reports import Pace

LINE_MAX = 64 * 1024  # characters printed without a line end before they count as a line


class RunLog:
    """Keeps the newest entries and passes each to ``logged``. The program waits for the readers in ``pace``."""

    def __init__(self, clock: Clock, run: Run, pace: Pace, logged: Callable[[LogEntry], None]) -> None:
        self.pace = pace
        self._clock, self._run, self._logged = clock, run, logged
        self._entries: deque[LogEntry] = deque(maxlen=LOG_MAX)
        self._line = ""  # printed without a line end so far
        self._catching_up: asyncio.Future[None] | None = None  # the program's wait for readers

    async def print(self, text: str) -> None:
        """Write whole lines, as fast as the program's share of the server allows."""
        meter = Meter(self._run.account)
        start = 0
        while (end := text.find("\n", start)) >= 0:
            self._end_line(text[start:end])
            start = end + 1
            if self.pace.joined and self._run.exit_reason is not ExitReason.KILLED:
                await self._let_readers_catch_up()
            if meter.over:
                await meter.turn()
        self._line += text[start:]
        if len(self._line) > LINE_MAX:
            self._end_line()
        meter.stop()

    async def _let_readers_catch_up(self) -> None:
        """Wait for readers of the log; ``hurry`` cuts the wait short."""
        self._catching_up = asyncio.ensure_future(self.pace.wait())
        await asyncio.wait((self._catching_up,))
        self._catching_up = None

    def hurry(self) -> None:
        """Stop waiting for readers, as the program was ended."""
        if self._catching_up is not None:
            self._catching_up.cancel()

    def close(self) -> None:
        """Write printed text without a line end as the last line."""
        if self._line:
            self._end_line()

    def _end_line(self, text: str = "") -> None:
        line, self._line = self._line + text, ""
        self.write("print", line)

    def write(self, level: str, text: str) -> None:
        """Add an entry."""
        clean = (text if level == "print" else text[:LOG_TEXT_MAX]).encode("utf-8", "replace").decode()
        entry = LogEntry(self._clock.epoch(), level, clean)
        self._entries.append(entry)
        self._logged(entry)

    def newest(self) -> list[LogEntry]:
        """Return the entries since the last ``take``."""
        return list(self._entries)

    def take(self) -> list[LogEntry]:
        """Return the entries since the last ``take`` and forget them."""
        entries = list(self._entries)
        self._entries.clear()
        return entries
