"""The studio's socket: a front end's frames of block programs, debugging, checks while typing, the log.

The page chooses one robot. It has the rights of every client of the doors: the same relay answers its frames, and sizes
and rates are bounded.
"""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import logging
import re
import time
from collections import deque
from collections.abc import Awaitable, Callable
from functools import lru_cache
from typing import Annotated

import msgspec

from roboglot.console import program_runs
from roboglot.console.desk import CLIENT, Desk
from roboglot.console.live import Ping
from roboglot.console.studio.class_map import draw_map
from roboglot.console.studio.class_requests import Member
from roboglot.console.studio.classroom import Room
from roboglot.console.studio.mistakes import explain
from roboglot.console.studio.programs import Programs
from roboglot.console.studio.trial import Trial, TrialEnd, TrialRequest
from roboglot.model.client_context import connection, identity
from roboglot.model.errors import NotFound, Refused, RobotError
from roboglot.operations import Right
from roboglot.programs.errors import ProgramError
from roboglot.programs.language import Problem
from roboglot.programs.stores import LogEntry
from roboglot.programs.tasks.reports import Insight, Reading
from roboglot.transport.limiter import Limiter
from roboglot.validation import decode_json
from roboglot.wire.visual.requests import BODY_MAX, FRAME_MAX, ID_MAX

log = logging.getLogger(__name__)

MESSAGE_MAX = FRAME_MAX + 64 * 1024  # characters per message from a page
MESSAGES_PER_SECOND_MAX = 50
PENDING_MAX = 16  # messages of one page that are being answered
LIGHT_EVERY = 0.02  # s: minimum between two highlighted blocks on a page
DRAW_EVERY = 2.0  # s between two maps of a pupil's robot shown to the teacher
WAITING_MAX = 2000  # messages queued for a slow page; beyond this the oldest insights are dropped
KIND = "type", "task", "name"  # of messages of which only the newest is sent
ASKED_MAX = 64  # unanswered inquiries of one page
_BLOCK = re.compile(r'"block": \{"type": "(begin|end)"')
_LIST = re.compile(r'\{"response": \{[^{}]*"id": "([^"\\]*)"')
Send = Callable[[str], Awaitable[None]]
Id = Annotated[str, msgspec.Meta(max_length=ID_MAX)]


class Open(msgspec.Struct, tag="open", tag_field="type", forbid_unknown_fields=True):
    """Robot that the page programs from now on, and the program shown; of others, only begin and end are reported."""

    robot: Id
    program: Id = ""  # in all messages


class FrameMessage(msgspec.Struct, tag="frame", tag_field="type", forbid_unknown_fields=True):
    """One frame for the robot (2002)."""

    text: str


class Debug(msgspec.Struct, tag="debug", tag_field="type", forbid_unknown_fields=True):
    """A request as on ``/debug`` of the door; the answer carries ``id``."""

    id: int
    text: str


class Check(msgspec.Struct, tag="check", tag_field="type", forbid_unknown_fields=True):
    """A program's text to be checked."""

    id: int
    body: Annotated[str, msgspec.Meta(max_length=BODY_MAX)]


class Fetch(msgspec.Struct, tag="fetch", tag_field="type", forbid_unknown_fields=True):
    """Request for a stored program or module and its whereabouts; ``log`` and ``text``: with these, too."""

    id: int
    program: Id
    module: bool = False
    log: bool = True
    text: bool = True


class _Named(msgspec.Struct):
    """Name of a frame, for its answers."""

    id: str = ""


def _id_of(text: str) -> str:
    """Return the id of a frame; "" if it has no readable one."""
    try:
        return decode_json(text, _Named).id
    except msgspec.MsgspecError:  # frames may have line breaks in their texts, which JSON has not
        found = re.search(r'"id"\s*:\s*"([^"\\]*)"', text)
        return found[1] if found else ""


def _named(message: Message) -> str | int:
    """Return the id under which the page waits for an answer; 0 if it waits for none."""
    return _id_of(message.text) if isinstance(message, FrameMessage) else getattr(message, "id", 0)


@lru_cache(maxsize=8)
def _framed(text: str) -> str:
    """Return a frame as a message to pages, which many pages share."""
    return msgspec.json.encode({"type": "frame", "text": text}).decode()


Message = Open | FrameMessage | Debug | Check | Fetch | TrialRequest | TrialEnd | Member | Ping
_decode = msgspec.json.Decoder(Message).decode


class Session:
    """One open page of the studio."""

    longest = 0  # bytes of a frame: no limit

    def __init__(self, desk: Desk, classroom: Room, send: Send, codes: Limiter) -> None:
        """``codes``: limits the tries of class codes per address."""
        self._desk, self._send, self._codes = desk, send, codes
        self._showed = ""  # address of an unverified code
        self._programs: Programs | None = None
        self._shown = ""  # the program shown; empty: all
        self._leaving: list[Callable[[], None]] = []
        self._waiting: deque[dict[str, object]] = deque()
        self._due = asyncio.Event()
        self._light: dict[str, object] | None = None  # the last block that began, while it waits
        self._pending: set[asyncio.Task[None]] = set()
        self._asked: deque[str] = deque(maxlen=ASKED_MAX)  # ids of frames
        self._trial = Trial(self.post)
        self._seat = classroom.seat(self.post)
        self._drawn = -DRAW_EVERY
        self._rate = Limiter(MESSAGES_PER_SECOND_MAX, 2.0 * MESSAGES_PER_SECOND_MAX, time.monotonic)

    async def run(self) -> None:
        """Send until cancelled."""
        lit = 0.0
        while True:
            await self._due.wait()
            self._due.clear()
            while self._waiting:
                if self._waiting[-1] is self._light and len(self._waiting) == 1:
                    with contextlib.suppress(TimeoutError):
                        await asyncio.wait_for(self._due.wait(), max(0.0, lit + LIGHT_EVERY - time.monotonic()))
                    lit = time.monotonic()
                message = self._waiting.popleft()
                if message is self._light:
                    self._light = None
                frame = message["type"] == "frame"
                await self._send(_framed(message["text"]) if frame else msgspec.json.encode(message).decode())

    def post(self, message: dict[str, object]) -> None:
        """Send a message when its turn comes."""
        if self._showed and message["type"] in ("joined", "elsewhere", "grid"):
            self._codes.give_back(self._showed)
            self._showed = ""
        if (old := self._replaced_by(message)) is not None:
            old.update(message)
            return
        if len(self._waiting) >= WAITING_MAX:
            seldom = next((m for m in self._waiting if m["type"] in ("reading", "variables", "log", "trial")), None)
            if seldom is None:
                return
            self._waiting.remove(seldom)
        self._waiting.append(message)
        self._due.set()

    def _replaced_by(self, message: dict[str, object]) -> dict[str, object] | None:
        """Return the waiting message that this one replaces, as only the newest of its kind is sent."""
        if message["type"] not in ("variables", "grid", "map"):
            return None
        kind = [message.get(key) for key in KIND]
        return next((waiting for waiting in self._waiting if [waiting.get(key) for key in KIND] == kind), None)

    # -- a front end of the frames --

    def answer(self, text: str) -> None:
        """Send an answer to a frame; lists requested by other pages are dropped."""
        if (found := _LIST.match(text)) is None or found[1] in self._asked:
            self.post({"type": "frame", "text": text})

    def publish(self, text: str) -> None:
        """Send a report of a task; of blocks that begin in quick succession, only the newest."""
        if (block := _BLOCK.search(text)) is None:
            self.answer(text)
        elif self._shown and f'"target_id": "{self._shown}"' not in text:
            pass  # the page highlights it by itself
        elif block[1] == "begin":
            if self._light is None or self._waiting[-1] is not self._light:
                self._light = {"type": "frame"}
                self.post(self._light)
            self._light["text"] = text

    async def drain(self) -> None:
        """Return at once: programs wait for no page."""

    # -- in --

    def receive(self, text: str | bytes) -> None:
        """Handle a message of the page. Raises ValueError for a bad message, or for too many."""
        if not self._rate.take(""):
            raise ValueError("too many messages")
        message = _decode(text)
        if isinstance(message, Ping):
            self.post({"type": "pong", "at": message.at})
            return
        if isinstance(message, Open):
            self._open(message)
            return
        if len(self._pending) >= PENDING_MAX:
            self.post({"type": "refused", "id": _named(message), "why": "too much is being answered"})
            return
        task = asyncio.get_running_loop().create_task(self._take(message), name=f"studio {type(message).__name__}")
        self._pending.add(task)
        task.add_done_callback(self._pending.discard)

    def _open(self, request: Open) -> None:
        name = request.robot
        self._leave()
        self._shown = request.program
        try:
            self._desk.view(name, "program")
            programs = self._desk.studio.programs.get(name)
            if programs is None:
                raise NotFound(f"robot {name} runs no block programs")
        except RobotError as error:
            self.post({"type": "opened", "robot": name, "error": str(error)})
            return
        self._programs = programs
        self._seat.at(name)
        service = programs.service
        self._leaving = [
            programs.frames.attach(self),
            service.log_entries.join(self._logged),
            service.insights.join(self._noticed),
        ]
        self.post({"type": "opened", "robot": name, "running": [figures.target_id for figures in service.running()]})

    async def _take(self, message: Message) -> None:
        try:
            await self._do(message)
        except (RobotError, ProgramError, ValueError) as error:
            self.post({"type": "refused", "id": _named(message), "why": str(error)})
        except Exception as error:  # the page waits for its answer
            log.exception("studio: %s crashed", type(message).__name__)
            self.post({"type": "refused", "id": _named(message), "why": f"internal error: {error}"})

    async def _do(self, message: Message) -> None:
        if isinstance(message, Member):
            await self._take_class(message)
            return
        programs = self._programs
        if programs is None:
            raise NotFound("no robot is chosen yet")
        programs.robot.admission.check(CLIENT, "program", Right.PROGRAM)
        match message:
            case FrameMessage(text=text):
                self._asked.append(_id_of(text))
                await programs.frames.receive(text)
            case Debug(id=id, text=text):
                self.post({"type": "debugged", "id": id, "text": await program_runs.debug(programs, text)})
            case Check(id=id, body=body):
                problems = await programs.service.check(body)
                self.post({"type": "checked", "id": id, "problems": [_plain(problem) for problem in problems]})
            case Fetch():
                await self._fetch(programs, message)
            case TrialRequest():
                await self._trial.take(message, self._desk.studio, programs)
            case TrialEnd():
                self._trial.close()

    async def _take_class(self, request: Member) -> None:
        if request.do == "join" and (who := identity()) in self._desk.pupils:  # a code signs in as one pupil
            name, _, code = who.rpartition("@")
            request = msgspec.structs.replace(request, name=name, code=code)
        elif request.code and request.do in ("join", "open"):
            self._show_code()
        await self._seat.take(request, may_teach=self._desk.may_teach)
        now = time.monotonic()
        if request.do == "doing" and self._programs is not None and now - self._drawn >= DRAW_EVERY:
            self._drawn = now
            if picture := await draw_map(self._programs.robot):
                self._seat.draw(picture)

    def _show_code(self) -> None:
        """Count a class code as wrong until the class confirms it. Raises Refused."""
        host = connection().rpartition(":")[0]
        if not self._codes.take(host):
            raise Refused("too many wrong codes from your address: wait a minute")
        self._showed = host

    async def _fetch(self, programs: Programs, request: Fetch) -> None:
        service = programs.service
        found = None
        if request.text:
            found = await (service.library.get(request.program) if request.module else service.get(request.program))
        entries = await service.log(request.program) if request.log and not request.module else []
        where = await service.whereabouts(request.program)
        newest = service.newest.get(request.program)
        self.post(
            {
                "type": "fetched",
                "id": request.id,
                "program": found,
                "log": [_entry(request.program, entry) for entry in entries],
                "where": where,
                "began": newest and newest.began,  # its newest run; null: before the server did
                "refused": newest.refused if newest else [],
            }
        )

    # -- out --

    def _logged(self, task: str, entry: LogEntry) -> None:
        if self._shown in ("", task):
            self.post({"type": "log", **_entry(task, entry)})

    def _noticed(self, insight: Insight) -> None:
        if self._shown not in ("", insight.task):
            return
        kind = "reading" if isinstance(insight, Reading) else "variables"
        self.post({"type": kind, **dataclasses.asdict(insight)})

    def _leave(self) -> None:
        for leave in self._leaving:
            leave()
        self._leaving, self._programs = [], None

    def close(self) -> None:
        """Close the page; its actions continue."""
        self._leave()
        self._trial.close()
        self._seat.close()


def _plain(problem: Problem) -> dict[str, object]:
    return {
        "line": problem.line,
        "column": problem.column,
        "kind": str(problem.kind),
        "en": problem.english,
        "zh": problem.chinese,
    }


def _entry(task: str, entry: LogEntry) -> dict[str, object]:
    found: dict[str, object] = {"task": task, "stamp": entry.at, "level": entry.level, "text": entry.text}
    if entry.level == "error":
        found |= explain(entry.text)
    return found
