"""Classes: a teacher opens one for the robots here, pupils join by its code and get a robot each.

With access control, a pupil is a guest with the right to program only that robot, for the lesson. A locked robot moves
only for the teacher. A class outlives the program, with its pupils' robots, until its time is over.
"""

from __future__ import annotations

import asyncio
import contextlib
import secrets
from collections.abc import Awaitable, Callable, Collection
from dataclasses import field
from typing import Annotated, Literal

import msgspec

from roboglot.console.desk import Desk
from roboglot.console.http import Problem
from roboglot.console.people.sessions import Session
from roboglot.console.studio import class_requests, classroom
from roboglot.console.studio.class_files import KeptClass, OpenClassFile
from roboglot.control.lease_server import LEASE
from roboglot.hosting.steady_time import SteadyTime
from roboglot.model.admission import Proof, Right
from roboglot.model.components.system.lease import TEACHER, Lease
from roboglot.model.components.system.resetting import reset
from roboglot.model.errors import Forbidden, NotFound, Refused, RobotError
from roboglot.model.robot import Robot
from roboglot.values import dataclass

MINUTES_MAX = 600
NAME_MAX = 30  # characters of a pupil's name
Name = Annotated[str, msgspec.Meta(max_length=class_requests.NAME_MAX)]


class ClassRequest(msgspec.Struct, forbid_unknown_fields=True):
    """Request of a teacher; ``pupil`` empty: for all."""

    do: Literal["open", "lock", "unlock", "reset", "give_back", "close"]
    name: Name = ""
    pupil: Annotated[str, msgspec.Meta(max_length=80)] = ""
    minutes: Annotated[int, msgspec.Meta(ge=1, le=MINUTES_MAX)] = 90


@dataclass(frozen=True, slots=True)
class Seat:
    """Seat of a pupil: ``identity`` is the name by which the robots know the pupil."""

    identity: str
    robot: str
    code: str
    proof: Proof | None
    studio: bool  # True if the class was opened in the studio


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """Console of the pupil's own world, at which to sign in."""

    page: str
    code: str
    name: str


@dataclass(slots=True)
class OpenClass:
    """A class that is open."""

    code: str
    name: str
    until: float
    seats: dict[str, Seat] = field(default_factory=dict)


class Classes:
    """The class of a console. ``present``: people with an open page; ``sign_out`` ends a person's sessions and pages.

    ``stop`` ends all programs and motion of a robot.
    """

    def __init__(
        self,
        desk: Desk,
        room: classroom.Room,
        stop: Callable[[str], Awaitable[None]],
        present: Callable[[], Collection[str]],
        sign_out: Callable[[str], Awaitable[None]],
        now: Callable[[], float] | None = None,
    ) -> None:
        self._desk, self._room, self._stop = desk, room, stop
        self._present, self._sign_out, self._now = present, sign_out, now or SteadyTime()
        self._file = OpenClassFile(desk.studio.classes) if desk.studio.classes is not None else None
        self._writing = asyncio.Lock()
        self._current = self._restored()
        self._studio: dict[str, OpenClass] = {}  # classes opened in the studio, in this world or another

    # -- pupils --

    async def join(self, code: str, name: str) -> Seat | Elsewhere:
        """Give a pupil a robot: the same as before, else a free one, else the least shared one.

        Raises Problem.
        """
        name = class_requests.plain_name(name)
        class_ = self._current
        if class_ is None or not secrets.compare_digest(code.strip().upper().encode(), class_.code.encode()):
            class_ = None
        elif class_.until < self._now():
            raise Problem(401, "this class is over")
        if not 0 < len(name) <= NAME_MAX or not name.isprintable() or set(name) & set(":@"):
            raise Problem(400, f"a name has 1 to {NAME_MAX} characters, without : and @")
        name = name.replace(" ", "-")
        if class_ is None:
            place = await self._admit(code, name)
            if place.page:
                return Elsewhere(place.page, place.code, name)
            class_ = self._studio.setdefault(place.code, OpenClass(place.code, "", 0.0))
            class_.until = self._now() + place.seconds
        return await self._seat(class_, f"{name}@{class_.code}")

    async def _admit(self, code: str, name: str) -> classroom.Place:
        try:
            return await self._room.admit(code.strip().upper(), name)
        except NotFound as error:
            raise Problem(401, str(error)) from None
        except Refused as error:
            raise Problem(409, str(error)) from None

    async def _seat(self, class_: OpenClass, identity: str) -> Seat:
        if identity in class_.seats and identity in self._present():
            raise Problem(409, f"{identity.partition('@')[0]} is in the class already")
        if identity not in class_.seats and len(class_.seats) >= classroom.PUPILS_MAX:
            raise Problem(409, f"the class has {classroom.PUPILS_MAX} pupils")
        robot = class_.seats[identity].robot if identity in class_.seats else self._least_used(class_)
        admission = self._desk.robots[robot].admission
        proof = await admission.invite(identity, frozenset({Right.PROGRAM}), class_.until - self._now())
        seat = class_.seats[identity] = Seat(identity, robot, class_.code, proof, class_ is not self._current)
        self._desk.pupils.add(identity)
        await self._save(class_)
        return seat

    def _least_used(self, class_: OpenClass) -> str:
        taken = [seat.robot for seat in class_.seats.values()]
        return min(self._desk.robots, key=taken.count)

    def _restored(self) -> OpenClass | None:
        """Return the class that was open when the program ended, with its pupils and locked robots.

        One that is over is left out, unless its teacher still has to unlock robots.
        """
        kept = self._file.load() if self._file is not None else None
        locked = {name for name, here in self._desk.robots.items() if Lease in here and here[Lease].taken_by == TEACHER}
        if kept is None or (kept.until <= self._now() and not locked):
            return None
        latest = self._now() + MINUTES_MAX * 60.0  # also where the clock was set back
        class_ = OpenClass(kept.code, kept.name, min(kept.until, latest))
        for identity, robot in kept.seats.items():
            if robot in self._desk.robots:
                class_.seats[identity] = Seat(identity, robot, kept.code, None, studio=False)
                self._desk.pupils.add(identity)
        self._desk.locked |= locked
        return class_

    async def _save(self, changed: OpenClass) -> None:
        """Write the open class of this console's page, or its absence, if that has changed."""
        if self._file is None or (self._current is not None and changed is not self._current):
            return
        async with self._writing:
            now = self._current
            seats = {seat.identity: seat.robot for seat in now.seats.values()} if now is not None else {}
            kept = KeptClass(now.code, now.name, now.until, seats) if now is not None else None
            await asyncio.to_thread(self._file.keep, kept)

    def restore(self, session: Session) -> None:
        """Return a pupil, whose session outlived the program, to the class with the same robot."""
        if session.code and session.robot in self._desk.robots:
            class_ = self._current if self._current is not None and session.code == self._current.code else None
            if class_ is None:
                class_ = self._studio.setdefault(session.code, OpenClass(session.code, "", 0.0))
            in_studio = class_ is not self._current
            class_.seats[session.name] = Seat(session.name, session.robot, session.code, None, in_studio)
            self._desk.pupils.add(session.name)

    async def end(self, code: str) -> None:
        """End a class of the studio: release its pupils' robots."""
        if (class_ := self._studio.pop(code, None)) is not None:
            for seat in list(class_.seats.values()):
                await self._give_back(class_, seat)

    # -- the teacher --

    def look(self) -> dict[str, object]:
        """Return the class for its teacher; empty if none is open. Raises Forbidden."""
        self.check_teacher()
        class_ = self._current
        if class_ is None:
            return {}
        present = self._present()
        pupils = [
            {
                "identity": seat.identity,
                "name": seat.identity.partition("@")[0],
                "robot": seat.robot,
                "here": seat.identity in present,
                "locked": seat.robot in self._desk.locked,
            }
            for seat in class_.seats.values()
        ]
        minutes = max(0, round((class_.until - self._now()) / 60.0))
        return {"code": class_.code, "name": class_.name, "minutes": minutes, "pupils": pupils}

    async def do(self, request: ClassRequest) -> dict[str, object]:
        """Carry out a teacher's request, and return the class. Raises Forbidden, NotFound, Refused."""
        with self._desk.noting(f"class {request.do}"):
            return await self._do(request)

    async def _do(self, request: ClassRequest) -> dict[str, object]:
        self.check_teacher()
        if request.do == "open":
            await self._open(request)
            return self.look()
        class_ = self._current
        if class_ is None:
            raise NotFound("no class is open")
        if request.pupil and request.pupil not in class_.seats:
            raise NotFound(f"there is no pupil {request.pupil!r}")
        seats = [class_.seats[request.pupil]] if request.pupil else list(class_.seats.values())
        doing = (self._do_with(request.do, robot) for robot in dict.fromkeys(seat.robot for seat in seats))
        ends = await asyncio.gather(*doing, return_exceptions=True)  # one that refuses spares no other
        for error in filter(None, ends):
            raise error
        if request.do in ("give_back", "close"):
            for seat in seats:
                await self._give_back(class_, seat)
        if request.do == "close":
            self._current = None
            await self._save(class_)
            with contextlib.suppress(Refused):
                await self._room.close(class_.code)
        return self.look()

    async def _open(self, request: ClassRequest) -> None:
        if self._current is not None:
            raise Refused(f"class {self._current.code} is open")
        code = "".join(secrets.choice(classroom.CODE_LETTERS) for _ in range(classroom.CODE_LENGTH))
        self._current = OpenClass(code, request.name.strip(), self._now() + request.minutes * 60.0)
        await self._save(self._current)
        await self._room.open(code, request.name.strip())  # the studio's page uses the same code to join

    async def _do_with(self, do: str, name: str) -> None:
        robot, locked = self._desk.robots[name], self._desk.locked
        if do == "lock" and name not in locked:
            locked.add(name)
            try:
                with robot.inputs.noting(LEASE, "give", {"who": TEACHER}):
                    await robot[Lease].take(TEACHER)
                await self._stop(name)  # after the lock, so that no program begins in between
            except BaseException:
                locked.discard(name)  # it moves for its pupil as before
                with contextlib.suppress(RobotError):
                    await _release(robot)
                raise
        elif do in ("unlock", "close") and name in locked:
            locked.discard(name)
            await _release(robot)
        if do == "reset":
            if name not in {placed.name for placed in self._desk.stage.robots}:
                raise Refused(f"robot {name} is a real one: carry it back by hand")
            await reset(robot, self._desk.stage, lambda: self._stop(name))
        if do in ("give_back", "close"):
            await self._stop(name)

    async def _give_back(self, class_: OpenClass, seat: Seat) -> None:
        """Release a pupil's robot; the pupil must join again."""
        del class_.seats[seat.identity]
        self._desk.pupils.discard(seat.identity)
        if seat.robot in self._desk.locked and seat.robot not in {left.robot for left in class_.seats.values()}:
            self._desk.locked.discard(seat.robot)
            with contextlib.suppress(RobotError):
                await _release(self._desk.robots[seat.robot])
        await self._desk.robots[seat.robot].admission.shut_out(seat.identity)
        await self._sign_out(seat.identity)
        await self._save(class_)  # last: a slow disk must not leave the pupil a right

    def check_teacher(self) -> None:
        """Raise Forbidden unless the current client may lead a class."""
        if not self._desk.may_teach:
            raise Forbidden("opening and leading a class needs the right admin on all robots")


async def _release(robot: Robot) -> None:
    """Release exclusive control of a robot. Raises RobotError."""
    with robot.inputs.noting(LEASE, "release", {"who": ""}):
        await robot[Lease].release()
