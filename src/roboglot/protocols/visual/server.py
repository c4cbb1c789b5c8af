"""The robot's end of the frames: bounded, answered in order, and never with an exception.

Knows the program service and one robot; carriers of the frames are none of its business.
"""

from __future__ import annotations

import asyncio
import dataclasses
import json
import logging
from collections.abc import Callable, Sequence

from roboglot.model.admission import Right
from roboglot.programs.stores import LogEntry
from roboglot.programs.tasks import debugging
from roboglot.programs.tasks.reports import TaskReport
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.browsers import Browsers
from roboglot.protocols.channels import Channel, Room, Send, texts
from roboglot.protocols.door import Endpoint
from roboglot.protocols.visual.config import VisualConfig
from roboglot.protocols.visual.dispatch import Dispatch
from roboglot.protocols.visual.errors import state_of_report
from roboglot.protocols.visual.front_ends import FrontEnds, Plain
from roboglot.protocols.visual.mirror import CloudMirror
from roboglot.protocols.websocket import WebSocketServer
from roboglot.transport.tls import Tls
from roboglot.wire.visual.relay import FrontEnd
from roboglot.wire.visual.replies import feedback
from roboglot.wire.visual.requests import ID_MAX, Kind

log = logging.getLogger(__name__)


class VisualDoor:
    """A ``FrameRelay`` over a program service; with an ``address``, also a WebSocket of the same frames there."""

    name = "visual"

    def __init__(
        self,
        service: ProgramService,
        address: str = "",
        config: VisualConfig | None = None,
        cloud: CloudMirror | None = None,
        tls: Tls | None = None,
    ) -> None:
        self._service = service
        self._cloud = cloud
        self._socket: WebSocketServer | None = None
        config = config or VisualConfig()
        if address and config.websocket:
            browsers = Browsers("[visual]", config.origins, config.hosts)
            self._socket = WebSocketServer(
                self._channels(), address, config.port, browsers, service.robot.admission, tls
            )
        self._front_ends = FrontEnds(service.robot)
        self._dispatch = Dispatch(service, self._front_ends, cloud)
        self._listening: list[Callable[[], None]] = []
        self._recording: set[asyncio.Task[None]] = set()

    async def start(self) -> None:
        """Start to report on tasks; the program engine warms up in the background."""
        if self._socket is not None:
            await self._socket.start()
        if self._cloud is not None:
            self._cloud.start()
        self._service.start()
        leave = self._service.robot.admission.on_lost(self._end_programs_of)
        self._listening = [
            leave,
            self._service.reports.join(self._report),
            self._service.pace.join(self._front_ends.room),
        ]
        if (stand_in := self._service.robot.stand_in) is not None:
            self._listening.append(stand_in.join(self.name, self._play))

    async def close(self) -> None:
        """Finish pending answers, end all runs, stop reporting."""
        await self._dispatch.close()
        await self._service.close()
        if self._socket is not None:
            await self._socket.close()
        await asyncio.gather(*self._recording)
        if self._cloud is not None:
            await self._cloud.close()
        for leave in self._listening:
            leave()
        self._front_ends.clear()

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """The WebSocket's address."""
        if self._socket is None:
            return ()
        address = f"{self._socket.scheme}://{self._socket.address}:{self._socket.port}"
        return [Endpoint("block programs", f"{address}/programs", f"roboglot program list --robot {address}")]

    def subscribe(self, send: Callable[[str], None]) -> Callable[[], None]:
        """Call ``send`` with every frame for front ends (code 2001), in order; returns what ends it."""
        return self._front_ends.add(Plain(send))

    def attach(self, front_end: FrontEnd) -> Callable[[], None]:
        """Hand every frame to this one; returns what ends it. Raises RuntimeError: there are too many."""
        return self._front_ends.add(front_end)

    async def receive(self, text: str) -> None:
        """Answer one frame from a front end (code 2002); returns when that is done."""
        await self._dispatch.receive(text)

    def _play(self, operation: str, message: bytes) -> None:
        """Send all front ends what a stand-in pushes."""
        if self._service.robot.tap.watched:
            self._service.robot.tap.push(self.name, "front ends", operation, message)
        self._front_ends.publish(message.decode("utf-8", "replace"))

    def _channels(self) -> dict[str, Channel]:
        """Return the WebSocket's paths; all but the first are ours."""

        def follow_frames(send: Send, room: Room) -> Callable[[], None]:
            return self._front_ends.add(Plain(send, room))

        def follow_nothing(_send: Send, _room: Room) -> Callable[[], None]:
            return lambda: None

        return {
            "/programs": texts(follow_frames, lambda text, _: self._dispatch.receive(text)),
            "/log": texts(self._follow_log, self._send_log),
            "/where": texts(follow_nothing, self._send_position),
            "/runs": texts(follow_nothing, self._send_runs),
            "/debug": texts(follow_nothing, self._debug, Right.PROGRAM),
        }

    def _follow_log(self, send: Send, room: Room) -> Callable[[], None]:
        """Send every line that a program writes; programs wait for a reader that is slower than they print."""
        leave = self._service.log_entries.join(lambda task, entry: send(log_line(task, entry)))
        leave_pace = self._service.log_pace.join(room)

        def leave_both() -> None:
            leave()
            leave_pace()

        return leave_both

    async def _send_log(self, text: str, send: Send) -> None:
        """Answer on ``/log``: the stored log of the task it names, then the number of lines."""
        task = text[:ID_MAX]
        entries = await self._service.log(task)
        for entry in entries:
            send(log_line(task, entry))
        send(json.dumps({"target_id": task, "entries": len(entries)}, ensure_ascii=False))

    async def _send_position(self, text: str, send: Send) -> None:
        """Answer on ``/where``: the current position of the task it names."""
        task = text[:ID_MAX]
        where = dataclasses.asdict(await self._service.whereabouts(task))
        send(json.dumps({"target_id": task} | where, ensure_ascii=False))

    async def _send_runs(self, _text: str, send: Send) -> None:
        """Answer any text on ``/runs``: the resources of each running task."""
        send(json.dumps({"runs": [dataclasses.asdict(figures) for figures in self._service.running()]}))

    async def _debug(self, text: str, send: Send) -> None:
        """Answer on ``/debug``; see ``debugging``."""
        send(await debugging.answer(self._service, text))

    def _end_programs_of(self, who: str) -> None:
        """They lost a right: what they run might count on it."""
        ending = self._service.end_of(who, f"{who} lost rights on this robot")
        task = asyncio.create_task(ending, name=f"end programs of {who}")
        self._recording.add(task)
        task.add_done_callback(self._recording.discard)

    def _report(self, report: TaskReport) -> None:
        """Send what happens to a task without a request; such frames carry a time stamp as their id."""
        text = feedback(
            kind=Kind.TASK,
            id=f"task_{int(self._service.robot.clock.epoch() * 1e6)}",
            target=report.task,
            operate=report.operation,
            state=state_of_report(report),
            describe=report.describe,
            block=report.block,
        )
        tap = self._service.robot.tap
        if tap.watched:
            tap.push(self.name, "front ends", "robot feedback" if report.block is None else "robot block", text)
        self._front_ends.publish(text)
        if self._cloud is not None and report.block is None:
            task = asyncio.create_task(self._cloud.send(text), name="record for the cloud")
            self._recording.add(task)
            task.add_done_callback(self._recording.discard)


def log_line(task: str, entry: LogEntry) -> str:
    """Return one entry of a task's log as ``/log`` sends it."""
    fields = {"target_id": task, "at": entry.at, "level": entry.level, "text": entry.text}
    return json.dumps(fields, ensure_ascii=False)
