"""Classes: a teacher opens one for the robots here, pupils join by its code and get a robot each.

A pupil is a guest of the admission where one is configured: with the right to program that robot, for the lesson, and
no other. What the teacher locks, only the teacher moves. A class lives as long as the program.
"""

from __future__ import annotations

import contextlib
import secrets
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import msgspec

from roboglot.console.desk import CLIENT, Desk
from roboglot.console.http import Problem
from roboglot.console.studio import classroom
from roboglot.model.admission import Proof, Right
from roboglot.model.components.system.lease import Lease
from roboglot.model.errors import Forbidden, NotFound, Refused, RobotError

MINUTES_MAX = 600
NAME_MAX = 30  # characters of a pupil's name
TEACHER = f"{CLIENT} teacher"  # who has control of a robot that is locked
Name = Annotated[str, msgspec.Meta(max_length=classroom.NAME_MAX)]


class Wish(msgspec.Struct, forbid_unknown_fields=True):
    """What a teacher wants; ``pupil`` empty: of all."""

    do: Literal["open", "lock", "unlock", "reset", "give_back", "close"]
    name: Name = ""
    pupil: Annotated[str, msgspec.Meta(max_length=80)] = ""
    minutes: Annotated[int, msgspec.Meta(ge=1, le=MINUTES_MAX)] = 90


@dataclass(frozen=True, slots=True)
class Seat:
    """A pupil's: ``identity`` is the name by which the robots know them."""

    identity: str
    robot: str
    code: str
    proof: Proof | None


@dataclass(slots=True)
class Lesson:
    """A class that is open."""

    code: str
    name: str
    until: float
    seats: dict[str, Seat] = field(default_factory=dict)


class Classes:
    """The one class of a console. ``present``: who has a page open; ``put_out`` ends the sessions and pages of one."""

    def __init__(
        self,
        desk: Desk,
        room: classroom.Classroom,
        present: Callable[[], Collection[str]],
        put_out: Callable[[str], None],
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._desk, self._room, self._present, self._put_out, self._now = desk, room, present, put_out, now
        self._lesson: Lesson | None = None

    # -- pupils --------------------------------------------------------------------------------------------------------

    async def join(self, code: str, name: str) -> Seat:
        """Give a pupil a robot: the same as before, else a free one, else the one that the fewest share.

        Raises Problem.
        """
        lesson, name = self._lesson, name.strip()
        if lesson is None or not secrets.compare_digest(code.strip().upper().encode(), lesson.code.encode()):
            raise Problem(401, "there is no class with this code")
        if lesson.until < self._now():
            raise Problem(401, "this class is over")
        if not 0 < len(name) <= NAME_MAX or not name.isprintable() or set(name) & set(":@"):
            raise Problem(400, f"a name has 1 to {NAME_MAX} characters, without : and @")
        identity = f"{name.replace(' ', '-')}@{lesson.code}"
        if identity in lesson.seats and identity in self._present():
            raise Problem(409, f"{name} is in the class already")
        if identity not in lesson.seats and len(lesson.seats) >= classroom.PUPILS_MAX:
            raise Problem(409, f"the class has {classroom.PUPILS_MAX} pupils")
        robot = lesson.seats[identity].robot if identity in lesson.seats else self._least_used(lesson)
        admission = self._desk.robots[robot].admission
        proof = await admission.invite(identity, frozenset({Right.PROGRAM}), lesson.until - self._now())
        seat = lesson.seats[identity] = Seat(identity, robot, lesson.code, proof)
        self._desk.pupils.add(identity)
        return seat

    def _least_used(self, lesson: Lesson) -> str:
        taken = [seat.robot for seat in lesson.seats.values()]
        return min(self._desk.robots, key=taken.count)

    # -- the teacher ---------------------------------------------------------------------------------------------------

    def look(self) -> dict[str, Any]:
        """The class as its teacher sees it; empty if none is open. Raises Forbidden."""
        self._check_teacher()
        lesson = self._lesson
        if lesson is None:
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
            for seat in lesson.seats.values()
        ]
        minutes = max(0, round((lesson.until - self._now()) / 60.0))
        return {"code": lesson.code, "name": lesson.name, "minutes": minutes, "pupils": pupils}

    async def do(self, wish: Wish) -> dict[str, Any]:
        """Do what a teacher wants, and show the class. Raises Forbidden, NotFound, Refused."""
        with self._desk.noting(f"class {wish.do}"):
            return await self._do(wish)

    async def _do(self, wish: Wish) -> dict[str, object]:
        self._check_teacher()
        if wish.do == "open":
            self._open(wish)
            return self.look()
        lesson = self._lesson
        if lesson is None:
            raise NotFound("no class is open")
        if wish.pupil and wish.pupil not in lesson.seats:
            raise NotFound(f"there is no pupil {wish.pupil!r}")
        seats = [lesson.seats[wish.pupil]] if wish.pupil else list(lesson.seats.values())
        for robot in dict.fromkeys(seat.robot for seat in seats):
            await self._do_with(wish.do, robot)
        if wish.do in ("give_back", "close"):
            for seat in seats:
                await self._give_back(lesson, seat)
        if wish.do == "close":
            self._room.classes.pop(lesson.code, None)
            self._lesson = None
        return self.look()

    def _open(self, wish: Wish) -> None:
        if self._lesson is not None:
            raise Refused(f"class {self._lesson.code} is open")
        code = "".join(secrets.choice(classroom.CODE_LETTERS) for _ in range(classroom.CODE_LENGTH))
        self._lesson = Lesson(code, wish.name.strip(), self._now() + wish.minutes * 60.0)
        self._room.classes[code] = classroom.Class(code, wish.name.strip())  # the studio's page joins by the same code

    async def _do_with(self, do: str, name: str) -> None:
        robot, locked = self._desk.robots[name], self._desk.locked
        if do == "lock" and name not in locked:
            locked.add(name)
            await self._room.stop(name)
            await robot[Lease].take(TEACHER)
        elif do in ("unlock", "close") and name in locked:
            locked.discard(name)
            await robot[Lease].release()
        if do in ("reset", "give_back", "close"):
            await self._room.stop(name)
        if do == "reset":
            if name not in {placed.name for placed in self._desk.stage.robots}:
                raise Refused(f"robot {name} is a real one: carry it back by hand")
            self._desk.stage.reset(name)

    async def _give_back(self, lesson: Lesson, seat: Seat) -> None:
        """The pupil has the robot no more and must join again."""
        del lesson.seats[seat.identity]
        self._desk.pupils.discard(seat.identity)
        if seat.robot in self._desk.locked and seat.robot not in {left.robot for left in lesson.seats.values()}:
            self._desk.locked.discard(seat.robot)
            with contextlib.suppress(RobotError):
                await self._desk.robots[seat.robot][Lease].release()
        await self._desk.robots[seat.robot].admission.shut_out(seat.identity)
        self._put_out(seat.identity)

    def _check_teacher(self) -> None:
        if not self._desk.may_teach:
            raise Forbidden("a class is opened and led by those who have the right to admin on all robots")
