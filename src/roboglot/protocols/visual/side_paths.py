"""Paths of the WebSocket beside ``/programs``, all our own: logs, positions, resources, debugging.

Recordings name a text's path as its operation, so that a recorded robot can answer on these paths, too.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Awaitable, Callable

from roboglot.model.admission import Right
from roboglot.model.errors import NotFound
from roboglot.programs.stores import LogEntry
from roboglot.programs.tasks import debugging
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.channels import Channel, Drain, Send, text_channel
from roboglot.protocols.visual.answers import DOOR
from roboglot.wire.visual.requests import ID_MAX

LOG, WHERE, RUNS, DEBUG = "/log", "/where", "/runs", "/debug"
READERS = "log readers"  # the tap's name for readers of programs' output


class SidePaths:
    """Side paths of one robot, from ``start`` to ``close``."""

    def __init__(self, service: ProgramService) -> None:
        self._service = service
        self._readers: list[Send] = []
        self._leave: Callable[[], None] = lambda: None

    def start(self) -> None:
        """Send the output of programs to all readers of the log."""
        self._leave = self._service.log_entries.join(self._logged)

    def close(self) -> None:
        """Stop sending."""
        self._leave()
        self._readers.clear()

    def channels(self) -> dict[str, Channel]:
        """Return the channels by path."""

        def follow_nothing(_send: Send, _drain: Drain) -> Callable[[], None]:
            return lambda: None

        return {
            LOG: text_channel(self._follow_log, self._noted(LOG, self._send_log)),
            WHERE: text_channel(follow_nothing, self._noted(WHERE, self._send_position)),
            RUNS: text_channel(follow_nothing, self._noted(RUNS, self._send_runs)),
            DEBUG: text_channel(follow_nothing, self._noted(DEBUG, self._debug), Right.PROGRAM),
        }

    def print(self, line: str) -> None:
        """Send one line of a log to all its readers."""
        if self._service.robot.tap.watched:
            self._service.robot.tap.push(DOOR, READERS, LOG, line)
        for send in tuple(self._readers):
            send(line)

    def _logged(self, task: str, entry: LogEntry) -> None:
        if self._readers or self._service.robot.tap.watched:
            self.print(log_line(task, entry))

    def _noted(
        self, path: str, answer: Callable[[str, Send], Awaitable[None]]
    ) -> Callable[[str, Send], Awaitable[None]]:
        """Return ``answer`` noted by the tap, or a responder's answers if there is one."""

        async def receive(text: str, send: Send) -> None:
            tap, responder = self._service.robot.tap, self._service.robot.responder
            began = tap.request(DOOR, path, text) if tap.watched else None

            def reply(line: str) -> None:
                if tap.watched:
                    tap.reply(DOOR, path, line, "ok", began=began)
                send(line)

            if responder is None:
                await answer(text, reply)
                return
            try:
                async for found in responder.answer(DOOR, path, text.encode(), reads=path != DEBUG):
                    reply(found.payload.decode("utf-8", "replace"))
            except NotFound as unknown:
                nothing: dict[str, object] = {"target_id": text[:ID_MAX], "error": str(unknown)}
                reply(json.dumps(nothing | ({"entries": 0} if path == LOG else {}), ensure_ascii=False))

        return receive

    def _follow_log(self, send: Send, drain: Drain) -> Callable[[], None]:
        """Send every line that a program writes; programs wait for a reader that is slower than they print."""
        self._readers.append(send)
        leave_pace = self._service.log_pace.join(drain)

        def leave() -> None:
            if send in self._readers:
                self._readers.remove(send)
            leave_pace()

        return leave

    async def _send_log(self, text: str, send: Send) -> None:
        """Answer on ``/log``: the stored log of the task with id ``text``, then the number of entries."""
        task = text[:ID_MAX]
        entries = await self._service.log(task)
        for entry in entries:
            send(log_line(task, entry))
        send(json.dumps({"target_id": task, "entries": len(entries)}, ensure_ascii=False))

    async def _send_position(self, text: str, send: Send) -> None:
        """Answer on ``/where``: the current position of the task with id ``text``."""
        task = text[:ID_MAX]
        where = dataclasses.asdict(await self._service.whereabouts(task))
        send(json.dumps({"target_id": task} | where, ensure_ascii=False))

    async def _send_runs(self, _text: str, send: Send) -> None:
        """Answer any text on ``/runs``: the resources of each running task."""
        send(json.dumps({"runs": [dataclasses.asdict(figures) for figures in self._service.running()]}))

    async def _debug(self, text: str, send: Send) -> None:
        """Answer on ``/debug``; see ``debugging``."""
        send(await debugging.answer(self._service, text))


def log_line(task: str, entry: LogEntry) -> str:
    """Return one entry of a task's log in the form of ``/log``."""
    fields = {"target_id": task, "at": entry.at, "level": entry.level, "text": entry.text}
    return json.dumps(fields, ensure_ascii=False)
