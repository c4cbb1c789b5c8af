"""The robot's end of the frames: bounded, answered in order, and never with an exception.

Knows the program service and one robot; carriers of the frames are none of its business.
"""

from __future__ import annotations

import asyncio
import dataclasses
import json
import logging
from collections.abc import Awaitable, Callable, Sequence
from contextlib import AsyncExitStack

from roboglot.model.admission import Forbidden, Right
from roboglot.model.errors import NotFound
from roboglot.model.stand_in import StandIn
from roboglot.programs.errors import ProgramError, StoreError
from roboglot.programs.stores import StoredProgram
from roboglot.programs.tasks import debugging
from roboglot.programs.tasks.reports import TaskReport
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.browsers import Browsers
from roboglot.protocols.door import Endpoint
from roboglot.protocols.visual.answers import Answers, program
from roboglot.protocols.visual.chapters import inquiries, modules, tasks
from roboglot.protocols.visual.config import VisualConfig
from roboglot.protocols.visual.errors import state_of, state_of_report
from roboglot.protocols.visual.front_ends import FrontEnds, Plain
from roboglot.protocols.visual.mirror import CloudMirror
from roboglot.protocols.visual.table import key_of, right_of
from roboglot.protocols.visual.websocket import Channel, Room, Send, WebSocketServer, log_line
from roboglot.transport.tls import Tls
from roboglot.wire.visual.codes import FeedbackState
from roboglot.wire.visual.relay import FrontEnd
from roboglot.wire.visual.replies import feedback
from roboglot.wire.visual.requests import ID_MAX, BadFrame, Kind, Request, parse_request

log = logging.getLogger(__name__)

PENDING_MAX = 64  # frames being answered at once
URGENT = frozenset({"suspend", "recover", "shutdown"})  # these wait for nothing but the start of the same task


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
        self._pending: dict[asyncio.Task[None], Request] = {}
        self._in_order = asyncio.Lock()
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
        await asyncio.gather(*self._pending)
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
        tap, began = self._service.robot.tap, None
        try:
            request = parse_request(text)
        except BadFrame as bad:
            answer = feedback(
                kind=bad.kind or "parse",
                id=bad.id,
                target=bad.target,
                operate=bad.operate,
                state=bad.state,
                describe=str(bad),
            )
            if tap.watched:
                tap.reply(self.name, "", answer, f"state {int(bad.state)}", str(bad), tap.request(self.name, "", text))
            self._front_ends.answer(answer)
            return
        if tap.watched:
            began = tap.request(self.name, key_of(request), text)
        answers = Answers(request, self._front_ends, self._cloud.note if self._cloud else None, tap, began)
        if len(self._pending) >= PENDING_MAX:
            answers.refuse(FeedbackState.INTERRUPTED, f"more than {PENDING_MAX} frames are being answered")
            return
        if self._service.robot.admission.asks:
            try:
                self._service.robot.admission.check(self.name, key_of(request), right_of(request))
            except Forbidden as forbidden:
                answers.refuse(FeedbackState.ILLEGAL, str(forbidden))
                return
        if self._service.robot.stand_in is not None:
            await self._ask_stand_in(self._service.robot.stand_in, request, text, answers, began)
            return
        # A task of its own: what is begun is brought to its end even if the carrier loses its client.
        starting = {id for pending in self._pending.values() if pending.operate == "run" for id in pending.targets}
        in_order = request.operate not in URGENT or not starting.isdisjoint(request.targets)
        task = asyncio.create_task(self._answer(request, answers, in_order=in_order), name=f"frame {request.operate}")
        self._pending[task] = request
        task.add_done_callback(self._pending.pop)
        await asyncio.shield(task)

    async def _ask_stand_in(
        self, stand_in: StandIn, request: Request, text: str, answers: Answers, began: float | None
    ) -> None:
        """Have another answer in the robot's place."""
        tap, key = self._service.robot.tap, key_of(request)
        try:
            reads = request.operate == "inquiry"
            async for reply in stand_in.answer(self.name, key, text.encode(), reads=reads):
                if tap.watched:
                    tap.reply(self.name, key, reply.payload, reply.status, began=began)
                self._front_ends.answer(reply.payload.decode("utf-8", "replace"))
        except NotFound as unknown:
            answers.refuse(FeedbackState.INTERRUPTED, str(unknown))

    def _play(self, operation: str, message: bytes) -> None:
        """Send all front ends what a stand-in pushes."""
        if self._service.robot.tap.watched:
            self._service.robot.tap.push(self.name, "front ends", operation, message)
        self._front_ends.publish(message.decode("utf-8", "replace"))

    async def _answer(self, request: Request, answers: Answers, *, in_order: bool) -> None:
        async with AsyncExitStack() as stack:
            if in_order:
                await stack.enter_async_context(self._in_order)
            try:
                await self._do(request, answers)
            except ProgramError as error:
                answers.refuse(state_of(error), str(error))
            except StoreError as error:
                log.warning("cannot store %s of %s: %s", request.operate, request.kind, error)
                answers.refuse(state_of(error), f"the list of programs can't be used: {error}")
            except Exception as error:  # a fault of ours must not leave a front end without an answer
                log.exception("%s of %s failed", request.operate, request.kind)
                answers.refuse(state_of(error), f"the robot could not do it: {error}")

    async def _do(self, request: Request, answers: Answers) -> None:
        if self._cloud is not None and request.operate == "inquiry" and not request.targets:
            await self._fetch(self._cloud, request.kind)
        match request.kind:
            case Kind.TASK:
                await tasks.answer(self._service, request, answers)
            case Kind.MODULE:
                await modules.answer(self._service.library, request, answers)
            case Kind.AI | Kind.SLAM:
                await inquiries.answer(self._service, request, answers)

    async def _fetch(self, cloud: CloudMirror, kind: Kind) -> None:
        """Save what the account has and the robot lacks; modules before the tasks that call them."""
        service = self._service
        if kind in (Kind.TASK, Kind.MODULE):
            known = [module.id for module in await service.library.modules()]
            await cloud.fetch(Kind.MODULE, known, lambda request: _saved(service.library.save, request))
        if kind is Kind.TASK:
            known = [task.id for task in await service.tasks()]
            await cloud.fetch(Kind.TASK, known, lambda request: _saved(service.save, request))

    def _channels(self) -> dict[str, Channel]:
        """Return the WebSocket's paths; all but the first are ours."""

        def follow_frames(send: Send, room: Room) -> Callable[[], None]:
            return self._front_ends.add(Plain(send, room))

        def follow_nothing(_send: Send, _room: Room) -> Callable[[], None]:
            return lambda: None

        return {
            "/programs": Channel(follow_frames, lambda text, _: self.receive(text)),
            "/log": Channel(self._follow_log, self._send_log),
            "/where": Channel(follow_nothing, self._send_position),
            "/runs": Channel(follow_nothing, self._send_runs),
            "/debug": Channel(follow_nothing, self._debug, Right.PROGRAM),
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


async def _saved(save: Callable[[StoredProgram], Awaitable[None]], request: Request) -> bool:
    """Save a program of the cloud; return False if it is refused."""
    try:
        await save(program(request))
    except ProgramError as error:
        log.warning("cannot save the %s %s from the cloud: %s", request.kind, request.targets[0], error)
        return False
    return True
