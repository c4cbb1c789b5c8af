"""Classes: a teacher opens one, pupils join by its code, the teacher watches their programs.

Pupils work in one world, each with a robot of it, or, if several programs share a classroom, each in their own world.
Knows no socket: a page is a seat.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections.abc import Awaitable, Callable
from dataclasses import field
from typing import Protocol

import msgspec

from roboglot.console.studio.class_files import ClassFiles, PupilWork
from roboglot.console.studio.class_requests import Member, PupilState, plain_name
from roboglot.hosting.steady_time import SteadyTime
from roboglot.model.errors import NotFound, Refused
from roboglot.values import dataclass

log = logging.getLogger(__name__)
CODE_LETTERS, CODE_LENGTH = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789", 6
CLASSES_MAX, PUPILS_MAX = 20, 60
NOWHERE = "-"  # the world of pupils who have none yet
GRID_EVERY = 0.1  # s between two grids of one class
OPEN_SECONDS = 90 * 60.0  # after a teacher's visit, for which the code admits pupils where access is controlled
Tell = Callable[[dict[str, object]], None]


@dataclass(frozen=True, slots=True)
class World:
    """A program with pupils' robots: the URL of its pages, and functions that stop a robot and end a class."""

    name: str
    page: str
    stop: Callable[[str], Awaitable[None]]
    end: Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Place:
    """Place of a pupil: ``page`` is another world's, empty for the one that asked; for how long (s)."""

    code: str
    page: str
    seconds: float


@dataclass(slots=True)
class Pupil:
    """A pupil who has joined; ``seat`` is None while the page is away."""

    name: str
    world: str = ""
    robot: str = ""
    seat: Seat | None = None
    doing: PupilState = field(default_factory=PupilState)
    work: PupilWork = field(default_factory=PupilWork)


def _idle(pupil: Pupil) -> bool:
    """Return whether a pupil can be dropped without loss: no page, no program, no star."""
    return pupil.seat is None and not (pupil.work.style or pupil.work.handed or pupil.doing.stars)


class Class:
    """A class and its teachers' pages. ``only``: its only world; empty: all."""

    def __init__(self, code: str, name: str, only: str = "") -> None:
        self.code, self.name, self.only = code, name, only
        self.until = 0.0
        self.pupils: dict[str, Pupil] = {}
        self.teachers: set[Seat] = set()
        self._due: asyncio.TimerHandle | None = None

    @property
    def is_empty(self) -> bool:
        """True if no page is in it."""
        return not self.teachers and all(pupil.seat is None for pupil in self.pupils.values())

    def enrol(self, name: str) -> Pupil:
        """Return the pupil of that name, a new one if there is none. Raises Refused."""
        if name not in self.pupils:
            if len(self.pupils) >= PUPILS_MAX and (idle := next(filter(_idle, self.pupils.values()), None)) is not None:
                del self.pupils[idle.name]
            if len(self.pupils) >= PUPILS_MAX:
                raise Refused(f"the class has {PUPILS_MAX} pupils")
            self.pupils[name] = Pupil(name, world=NOWHERE, work=PupilWork(name))
        return self.pupils[name]

    def notify_teachers(self) -> None:
        """Schedule an update of the grid on every teacher's page."""
        if self._due is None:
            self._due = asyncio.get_running_loop().call_later(GRID_EVERY, self._send_grid)

    def _send_grid(self) -> None:
        self._due = None
        rows = [
            {"name": p.name, "world": p.world, "robot": p.robot, "here": p.seat is not None}
            | msgspec.to_builtins(p.doing)
            | {"handed": bool(p.work.handed), "handed_stars": p.work.stars}
            for p in self.pupils.values()
        ]
        for seat in self.teachers:
            seat.post({"type": "grid", "code": self.code, "name": self.name, "pupils": rows})


class SeatProtocol(Protocol):
    """One page's place in a classroom."""

    async def take(self, request: Member, *, may_teach: bool) -> None:
        """Execute a page's request. Raises NotFound and Refused, or posts them."""

    def at(self, robot: str) -> None:
        """Set the page's robot from now on."""

    def draw(self, picture: str) -> None:
        """Show teachers the robot's map, a PNG in base64."""

    def close(self) -> None:
        """Remove a page that has gone; the work of its pupil stays."""


class Room(Protocol):
    """A classroom, wherever it is."""

    def seat(self, post: Tell) -> SeatProtocol:
        """Return a place for a page."""

    async def open(self, code: str, name: str) -> None:
        """Have a class for this program's own world."""

    async def close(self, code: str) -> None:
        """End a class and delete its hand-ins."""

    async def admit(self, code: str, name: str) -> Place:
        """Return the world of a pupil with a class's code. Raises NotFound, Refused."""


class Classroom:
    """All classes of one console, or of the consoles of all ``worlds``. What pupils hand in is kept in ``files``."""

    def __init__(self, files: ClassFiles | None = None, now: Callable[[], float] | None = None) -> None:
        self._files, self._writing, self.now = files, asyncio.Lock(), now or SteadyTime()
        self.worlds: dict[str, World] = {}
        self.classes: dict[str, Class] = {}
        for record in files.load() if files else []:
            kept = self.classes[record.code] = Class(record.code, record.name, record.only)
            kept.until = record.until
            for work in record.works:
                doing = PupilState(stars=work.all_stars, program=work.program)
                kept.pupils[work.name] = Pupil(work.name, work.world, "", None, doing, work)

    def seat(self, post: Tell, world: str = "") -> Seat:
        """Return a place for a page of a world."""
        return Seat(self, post, world)

    def find(self, code: str) -> Class:
        """Return a class. Raises NotFound."""
        found = self.classes.get(code.strip().upper())
        if found is None:
            raise NotFound(f"there is no class {code!r}")
        return found

    async def open(self, code: str, name: str) -> None:
        """Have a class for this program's own world. Raises Refused."""
        await self.begin(name, code)

    async def close(self, code: str) -> None:
        """End the class and delete its hand-ins."""
        await self.end(code)

    async def begin(self, name: str, code: str = "", only: str = "") -> Class:
        """Open a class; where there are too many, the oldest without a page in it gives way. Raises Refused."""
        if len(self.classes) >= CLASSES_MAX:
            if (oldest := next((one for one in self.classes.values() if one.is_empty), None)) is None:
                raise Refused(f"{CLASSES_MAX} classes are open")
            await self.end(oldest.code)
        code = code or "".join(secrets.choice(CODE_LETTERS) for _ in range(CODE_LENGTH))
        opened = self.classes[code] = Class(code, name, only)
        await self.save(opened)
        return opened

    async def save(self, kept: Class) -> None:
        """Save a class's own data."""
        if self._files is None:
            return
        async with self._writing:
            if self.classes.get(kept.code) is not kept:
                return  # it was ended meanwhile
            try:
                await asyncio.to_thread(self._files.begin, kept.code, kept.name, kept.only, kept.until)
            except OSError as error:
                log.error("cannot store class %s: %s", kept.code, error)

    async def end(self, code: str) -> None:
        """Delete a class with its hand-ins; its pages are notified."""
        if (ended := self.classes.pop(code, None)) is None:
            return
        for seat in [*ended.teachers, *(pupil.seat for pupil in ended.pupils.values() if pupil.seat is not None)]:
            seat.leave()
            seat.post({"type": "ended"})
        for world in self.worlds.values():
            world.end(code)
        if self._files is not None:
            async with self._writing:
                await asyncio.to_thread(self._files.end, code)

    async def admit(self, code: str, name: str, at: str = "") -> Place:
        """Return the world of a pupil who signs in at some world with a class's code. Raises NotFound, Refused."""
        joined = self.find(code)
        seconds = joined.until - self.now()
        if seconds <= 0.0:
            raise NotFound("this class is over, unless its teacher comes back")
        pupil = joined.enrol(name)
        elsewhere = self.place(joined, pupil, at)
        await self.keep(joined.code, pupil)
        return Place(joined.code, "" if elsewhere is None else elsewhere.page, seconds)

    async def keep(self, code: str, pupil: Pupil) -> None:
        """Save a pupil's data, if there are any. Raises Refused if it cannot be kept."""
        if self._files is None or not (pupil.work.style or pupil.work.handed):
            return
        try:
            async with self._writing:  # in order, so that the newest stays
                await asyncio.to_thread(self._files.keep, code, pupil.work)
        except OSError as error:
            log.error("cannot store the program handed in by %s: %s", pupil.name, error)
            raise Refused("it cannot be saved on the disk of the teacher's machine") from None

    def place(self, joined: Class, pupil: Pupil, at: str) -> World | None:
        """Return the world that a pupil is to go to from the page's: their own, else one that the fewest share."""
        choices = [joined.only] if joined.only in self.worlds else list(self.worlds)
        if pupil.world not in choices:
            taken = [one.world for one in joined.pupils.values()]
            pupil.world = min(choices, key=lambda name: (taken.count(name), name != at), default=at)
        pupil.work.world = pupil.world
        return None if pupil.world == at else self.worlds[pupil.world]

    async def stop_all(self, taught: Class) -> int:
        """End what the robots of all pupils do, of those whose page is away, too; return their number.

        Raises Refused.
        """
        robots = dict.fromkeys((p.world, p.robot) for p in taught.pupils.values() if p.robot)
        found = [(self.worlds.get(world), world, robot) for world, robot in robots]
        stops = [world.stop(robot) for world, _, robot in found if world is not None]
        failed = [f"{world} {robot}".strip() for there, world, robot in found if there is None]
        ends = await asyncio.gather(*stops, return_exceptions=True)
        failed += [str(error) for error in ends if isinstance(error, BaseException)]
        if failed:
            raise Refused(f"not stopped: {', '.join(failed)}")
        return len(robots)


class Seat:
    """One page's place: free, a teacher's or a pupil's."""

    def __init__(self, room: Classroom, post: Tell, world: str) -> None:
        self._room, self.post, self._world = room, post, world
        self._robot = ""
        self._gone = False
        self._class: Class | None = None
        self._pupil: Pupil | None = None

    def at(self, robot: str) -> None:
        """Set the page's robot from now on."""
        self._robot = robot
        if self._pupil is not None and self._class is not None:
            self._pupil.robot = robot
            self._class.notify_teachers()

    async def take(self, request: Member, *, may_teach: bool) -> None:
        """Execute a page's request, unless the page has gone. Raises NotFound, Refused."""
        if self._gone:
            return
        match request.do:
            case "open":
                await self._open(request, may_teach)
            case "join":
                await self._join(request)
            case "leave":
                self.leave()
            case "doing" | "hand_in":
                await self._note(request)
            case "close":
                await self._room.end(self._taught().code)
            case "stop_all":
                self.post({"type": "stopped", "robots": await self._room.stop_all(self._taught())})
            case "look":
                shown = self._taught().pupils.get(request.name)
                if shown is None:
                    raise NotFound(f"there is no pupil {request.name!r}")
                style = shown.work.handed or shown.work.style
                self.post({"type": "looked", "id": request.id, "name": shown.name, "style": style})

    async def _open(self, request: Member, may_teach: bool) -> None:
        """Open a class, or with its code come back to it as its teacher."""
        if not may_teach:
            raise Refused("opening a class needs the right admin on the robots")
        opened = self._room.find(request.code) if request.code else await self._room.begin(request.name.strip())
        if self._gone:
            return  # a class without a page in it gives way to others
        self.leave()
        self._class = opened
        opened.until = self._room.now() + OPEN_SECONDS
        opened.teachers.add(self)
        opened.notify_teachers()
        await self._room.save(opened)

    async def _join(self, request: Member) -> None:
        name, joined = plain_name(request.name), self._room.find(request.code)
        if not name:
            raise Refused("give a name")
        if not name.isprintable():
            raise Refused("a name has letters, and no line breaks or invisible characters")
        self.leave()
        pupil = joined.enrol(name)
        if pupil.seat is not None:
            raise Refused(f"{name} is in the class already")
        pupil.work.style = request.style or pupil.work.style
        before = pupil.work.world
        elsewhere = self._room.place(joined, pupil, self._world)
        if elsewhere is not None:
            self.post({"type": "elsewhere", "code": joined.code, "name": name, "page": elsewhere.page})
            joined.notify_teachers()
        else:
            self._sit(joined, pupil, pupil.work.style if request.carry else "")
        if pupil.work.world != before:
            await self._room.keep(joined.code, pupil)

    def _sit(self, joined: Class, pupil: Pupil, style: str) -> None:
        """``style``: the program that the page is to go on with; nothing: with its own."""
        pupil.seat, self._class, self._pupil, name = self, joined, pupil, pupil.name
        number = [one.name for one in joined.pupils.values() if one.world == self._world].index(name)
        words: dict[str, object] = {"code": joined.code, "name": name, "class": joined.name, "style": style}
        self.post({"type": "joined", "number": number, **words})
        self.at(self._robot)

    async def _note(self, request: Member) -> None:
        joined, pupil = self._class, self._pupil
        if joined is None or pupil is None:
            return
        pupil.doing, work = request.doing, pupil.work
        work.style, work.program, work.all_stars = (
            request.style or work.style,
            request.doing.program,
            request.doing.stars,
        )
        if request.do == "hand_in":
            work.handed, work.stars = work.style, request.doing.stars
            await self._room.keep(joined.code, pupil)
            self.post({"type": "handed"})
        joined.notify_teachers()

    def draw(self, picture: str) -> None:
        """Show teachers the robot's map, a PNG in base64."""
        if self._class is not None and self._pupil is not None:
            for seat in self._class.teachers:
                seat.post({"type": "map", "name": self._pupil.name, "png": picture})

    def _taught(self) -> Class:
        if self._class is None or self not in self._class.teachers:
            raise Refused("only the teacher of the class may do that")
        return self._class

    def close(self) -> None:
        """Remove a page that has gone; requests of it that are under way take no place any more."""
        self.leave()
        self._gone = True

    def leave(self) -> None:
        """Leave the class; the work of the page's pupil stays."""
        if self._class is None:
            return
        if self._pupil is not None:
            self._pupil.seat = None
        self._class.teachers.discard(self)
        left, self._class, self._pupil = self._class, None, None
        left.notify_teachers()
