"""Dispatch of frames: parses a frame, calls its handler, reports errors. Never raises; knows no carrier."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack

from roboglot.model.admission import Forbidden
from roboglot.model.errors import NotFound
from roboglot.model.responder import Responder
from roboglot.operations import Right
from roboglot.programs.errors import ProgramError, StoreError
from roboglot.programs.stores import StoredProgram
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.visual.answers import DOOR, Answers
from roboglot.protocols.visual.chapters import inquiries, modules, tasks  # noqa: F401 - they fill the table
from roboglot.protocols.visual.context import Context
from roboglot.protocols.visual.errors import state_of
from roboglot.protocols.visual.front_ends import FrontEnds
from roboglot.protocols.visual.mirror import CloudMirror
from roboglot.protocols.visual.table import TABLE
from roboglot.protocols.visual.vocabulary import key_of, program
from roboglot.wire.visual.codes import FeedbackState
from roboglot.wire.visual.replies import feedback
from roboglot.wire.visual.requests import BadFrame, FrameSubject, Request, parse_request

log = logging.getLogger(__name__)

PENDING_MAX = 64  # frames in progress
# These wait only for the start of the same task; in lockstep, where time waits, for all earlier frames.
URGENT = frozenset({"suspend", "recover", "shutdown"})


class Dispatch:
    """Answers the frames of all front ends to one robot, in order."""

    def __init__(self, service: ProgramService, front_ends: FrontEnds, cloud: CloudMirror | None) -> None:
        self._service = service
        self._front_ends = front_ends
        self._cloud = cloud
        self._pending: dict[asyncio.Task[None], Request] = {}
        self._in_order = asyncio.Lock()

    async def close(self) -> None:
        """Finish pending answers."""
        await asyncio.gather(*self._pending)

    async def receive(self, text: str) -> None:
        """Answer one frame from a front end (code 2002); return when it is answered."""
        tap, began = self._service.robot.tap, None
        try:
            request = parse_request(text)
        except BadFrame as bad:
            self._refuse_unreadable(text, bad)
            return
        if tap.watched:
            began = tap.request(DOOR, key_of(request), text)
        answers = Answers(request, self._front_ends, self._cloud.note if self._cloud else None, tap, began)
        if len(self._pending) >= PENDING_MAX:
            answers.refuse(FeedbackState.INTERRUPTED, f"more than {PENDING_MAX} frames are being answered")
            return
        if self._service.robot.admission.enforced:
            try:
                self._service.robot.admission.check(DOOR, key_of(request), _right_of(request))
            except Forbidden as forbidden:
                answers.refuse(FeedbackState.ILLEGAL, str(forbidden))
                return
        if self._service.robot.responder is not None:
            await self._ask_responder(self._service.robot.responder, request, text, answers, began)
            return
        # A separate task, so that an operation is completed even if the client disconnects.
        await asyncio.shield(self._begin(request, answers))

    def _refuse_unreadable(self, text: str, bad: BadFrame) -> None:
        """Answer a text that is not a frame."""
        answer = feedback(
            kind=bad.kind or "parse",
            id=bad.id,
            target=bad.target,
            operate=bad.operate,
            state=bad.state,
            describe=str(bad),
        )
        tap = self._service.robot.tap
        if tap.watched:
            tap.reply(DOOR, "", answer, f"state {int(bad.state)}", str(bad), tap.request(DOOR, "", text))
        self._front_ends.answer(answer)

    def _begin(self, request: Request, answers: Answers) -> asyncio.Task[None]:
        """Start answering a frame: after all earlier ones, or at once if it is urgent."""
        starting = {id for pending in self._pending.values() if pending.operate == "run" for id in pending.targets}
        urgent = request.operate in URGENT and not self._service.robot.clock.repeats
        in_order = not urgent or not starting.isdisjoint(request.targets)
        task = asyncio.create_task(self._answer(request, answers, in_order=in_order), name=f"frame {request.operate}")
        self._pending[task] = request
        task.add_done_callback(self._pending.pop)
        return task

    async def _ask_responder(
        self, responder: Responder, request: Request, text: str, answers: Answers, began: float | None
    ) -> None:
        """Let the responder answer in the robot's place."""
        tap, key = self._service.robot.tap, key_of(request)
        try:
            reads = request.operate == "inquiry"
            async for reply in responder.answer(DOOR, key, text.encode(), reads=reads):
                if tap.watched:
                    tap.reply(DOOR, key, reply.payload, reply.status, began=began)
                self._front_ends.answer(reply.payload.decode("utf-8", "replace"))
        except NotFound as unknown:
            answers.refuse(FeedbackState.INTERRUPTED, str(unknown))

    async def _answer(self, request: Request, answers: Answers, *, in_order: bool) -> None:
        async with AsyncExitStack() as stack:
            stack.enter_context(self._service.robot.clock.holding())
            if in_order:
                await stack.enter_async_context(self._in_order)
            try:
                await self._do(request, answers)
            except ProgramError as error:
                answers.refuse(state_of(error), str(error))
            except StoreError as error:
                log.warning("cannot store %s of %s: %s", request.operate, request.kind, error)
                answers.refuse(state_of(error), f"the list of programs can't be used: {error}")
            except Exception as error:  # an internal error must not leave a front end without an answer
                log.exception("%s of %s failed", request.operate, request.kind)
                answers.refuse(state_of(error), f"the robot could not do it: {error}")

    async def _do(self, request: Request, answers: Answers) -> None:
        if self._cloud is not None and request.operate == "inquiry" and not request.targets:
            await self._fetch(self._cloud, request.kind)
        operation = TABLE.get(key_of(request))
        assert operation is not None  # parse_request rejects all other frames
        await operation.handler(Context(self._service, request, answers))

    async def _fetch(self, cloud: CloudMirror, kind: FrameSubject) -> None:
        """Save the account's programs that the robot lacks; modules before the tasks that call them."""
        service = self._service
        if kind in (FrameSubject.TASK, FrameSubject.MODULE):
            known = [module.id for module in await service.library.modules()]
            await cloud.fetch(FrameSubject.MODULE, known, lambda request: _saved(service.library.save, request))
        if kind is FrameSubject.TASK:
            known = [task.id for task in await service.tasks()]
            await cloud.fetch(FrameSubject.TASK, known, lambda request: _saved(service.save, request))


def _right_of(request: Request) -> Right | None:
    """Return the right that a frame needs: inquiries only need the right to see."""
    operation = TABLE.get(key_of(request))
    return operation.right if operation else Right.ADMIN


async def _saved(save: Callable[[StoredProgram], Awaitable[None]], request: Request) -> bool:
    """Save a program of the cloud; return False if it is refused."""
    try:
        await save(program(request))
    except ProgramError as error:
        log.warning("cannot save the %s %s from the cloud: %s", request.kind, request.targets[0], error)
        return False
    return True
