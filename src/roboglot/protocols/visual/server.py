"""The robot's end of the frames: bounded, answered in order, and without exceptions.

Knows the program service and one robot, but not the carriers of the frames.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence

from roboglot.programs.tasks.reports import TaskReport
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.browsers import Browsers
from roboglot.protocols.channels import Channel, Drain, Send, noted, taking_turns, text_channel
from roboglot.protocols.door import Endpoint
from roboglot.protocols.visual.config import VisualConfig
from roboglot.protocols.visual.dispatch import Dispatch
from roboglot.protocols.visual.errors import state_of_report
from roboglot.protocols.visual.front_ends import FrontEnds, Plain
from roboglot.protocols.visual.mirror import CloudMirror
from roboglot.protocols.visual.side_paths import LOG, SidePaths
from roboglot.protocols.websocket import WebSocketServer
from roboglot.transport.tls import Tls
from roboglot.wire.visual.relay import FrontEnd
from roboglot.wire.visual.replies import feedback
from roboglot.wire.visual.requests import FrameSubject, stops

log = logging.getLogger(__name__)


class VisualDoor:
    """A ``FrameRelay`` of a program service; with an ``address``, also a WebSocket with the same frames."""

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
        self._side_paths = SidePaths(service)
        config = config or VisualConfig()
        if address and config.websocket:
            browsers = Browsers("[visual]", config.origins, config.hosts, service.robot.admission)
            self._socket = WebSocketServer(
                self._channels(), address, config.port, browsers, service.robot.admission, tls
            )
        self._front_ends = FrontEnds(service.robot)
        self._dispatch = Dispatch(service, self._front_ends, cloud)
        self._listening: list[Callable[[], None]] = []
        self._recording: set[asyncio.Task[None]] = set()

    async def start(self) -> None:
        """Start to report on tasks; the program engine warms up a little later."""
        if self._socket is not None:
            await self._socket.start()
        if self._cloud is not None:
            self._cloud.start()
        self._service.start()
        self._side_paths.start()
        leave = self._service.robot.admission.on_lost(self._end_programs_of)
        self._listening = [
            leave,
            self._service.reports.join(self._report),
            self._service.pace.join(self._front_ends.drain),
        ]
        if (responder := self._service.robot.responder) is not None:
            self._listening.append(responder.join(self.name, self._play))

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
        self._side_paths.close()
        self._front_ends.clear()

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """The WebSocket's address."""
        if self._socket is None:
            return ()
        address = f"{self._socket.scheme}://{self._socket.address}:{self._socket.port}"
        return [Endpoint("block programs", f"{address}/programs", f"roboglot program list --robot {address}")]

    def subscribe(self, send: Callable[[str], None]) -> Callable[[], None]:
        """Call ``send`` with every frame for front ends (code 2001), in order; return a function that ends it."""
        return self._front_ends.add(Plain(send))

    def attach(self, front_end: FrontEnd) -> Callable[[], None]:
        """Send every frame to this front end; return a function that ends it. Raises RuntimeError for too many."""
        return self._front_ends.add(front_end)

    async def receive(self, text: str) -> None:
        """Answer one frame from a front end (code 2002); return when it is answered."""
        await self._dispatch.receive(text)

    def _play(self, operation: str, message: bytes) -> None:
        """Send a responder's push to all front ends, or to the readers of the log."""
        if operation == LOG:
            self._side_paths.print(message.decode("utf-8", "replace"))
            return
        if self._service.robot.tap.watched:
            self._service.robot.tap.push(self.name, "front ends", operation, message)
        self._front_ends.publish(message.decode("utf-8", "replace"))

    def _channels(self) -> dict[str, Channel]:
        """Return the WebSocket's channels by path; all but ``/programs`` are our own."""

        def follow_frames(send: Send, drain: Drain) -> Callable[[], None]:
            return self._front_ends.add(Plain(send, drain))

        found = {
            "/programs": text_channel(follow_frames, lambda text, _: self._dispatch.receive(text)),
            **self._side_paths.channels(),
        }
        robot = self._service.robot
        fair = {path: taking_turns(channel, robot, lambda text: stops(str(text))) for path, channel in found.items()}
        return {path: noted(channel, robot.inputs, self.name, path) for path, channel in fair.items()}

    def _end_programs_of(self, who: str) -> None:
        """End the programs of a client that lost rights, as they might depend on them."""
        ending = self._service.end_of(who, f"{who} lost rights on this robot")
        task = asyncio.create_task(ending, name=f"end programs of {who}")
        self._recording.add(task)
        task.add_done_callback(self._recording.discard)

    def _report(self, report: TaskReport) -> None:
        """Send a report of a task; its frame has a time stamp as its id, as it answers no request."""
        text = feedback(
            kind=FrameSubject.TASK,
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
