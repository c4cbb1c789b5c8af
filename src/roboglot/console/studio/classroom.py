"""Classes: a teacher opens one, pupils join by its code, the teacher sees what each one's program does. In memory.

A class lives as long as the program. Every pupil works on a robot of the same world; the pages choose which.
"""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import msgspec

from roboglot.model.errors import NotFound, Refused

CODE_LETTERS, CODE_LENGTH = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789", 6
CLASSES_MAX, PUPILS_MAX = 20, 60
NAME_MAX, WORDS_MAX, STYLE_MAX = 40, 300, 400_000  # characters
Tell = Callable[[dict[str, Any]], None]
Words = Annotated[str, msgspec.Meta(max_length=WORDS_MAX)]


class Doing(msgspec.Struct, frozen=True):
    """What a pupil's page shows."""

    phase: Words = "idle"
    lit: Words = ""
    program: Words = ""
    error: Words = ""
    mission: Words = ""
    stars: Annotated[int, msgspec.Meta(ge=0, le=1000)] = 0


class Member(msgspec.Struct, tag="class", tag_field="type"):
    """What a page wishes of its class."""

    do: Literal["open", "join", "leave", "doing", "hand_in", "stop_all", "look"]
    id: int = 0
    code: Annotated[str, msgspec.Meta(max_length=12)] = ""
    name: Annotated[str, msgspec.Meta(max_length=NAME_MAX)] = ""
    doing: Doing = Doing()
    style: Annotated[str, msgspec.Meta(max_length=STYLE_MAX)] = ""


@dataclass(slots=True)
class Pupil:
    """One who has joined; ``seat`` is None while the page is away."""

    name: str
    seat: Seat | None
    doing: Doing = field(default_factory=Doing)
    style: str = ""
    handed: str = ""  # what was handed in last
    handed_stars: int = 0


@dataclass(slots=True)
class Class:
    """A class and its teachers' pages."""

    code: str
    name: str
    pupils: dict[str, Pupil] = field(default_factory=dict)
    teachers: set[Seat] = field(default_factory=set)

    def tell_teachers(self) -> None:
        """Have every teacher's page show the grid anew."""
        rows = [
            {"name": p.name, "robot": p.seat.robot if p.seat else "", "here": p.seat is not None}
            | msgspec.to_builtins(p.doing)
            | {"handed": bool(p.handed), "handed_stars": p.handed_stars}
            for p in self.pupils.values()
        ]
        for seat in self.teachers:
            seat.tell({"type": "grid", "code": self.code, "name": self.name, "pupils": rows})


class Classroom:
    """All classes of one console. ``stop`` ends all programs and motion of a robot."""

    def __init__(self, stop: Callable[[str], Awaitable[None]]) -> None:
        self.stop = stop
        self.classes: dict[str, Class] = {}

    def seat(self, tell: Tell) -> Seat:
        """A page that may take part."""
        return Seat(self, tell)

    def find(self, code: str) -> Class:
        """Return a class. Raises NotFound."""
        found = self.classes.get(code.strip().upper())
        if found is None:
            raise NotFound(f"there is no class {code!r}")
        return found


class Seat:
    """One page's place: nobody's, a teacher's or a pupil's."""

    def __init__(self, room: Classroom, tell: Tell) -> None:
        self._room, self.tell = room, tell
        self.robot = ""
        self._class: Class | None = None
        self._pupil: Pupil | None = None

    async def take(self, wish: Member, *, may_teach: bool) -> None:
        """Do what the page wishes. Raises NotFound, Refused."""
        match wish.do:
            case "open":
                self._open(wish, may_teach)
            case "join":
                self._join(wish)
            case "leave":
                self.leave()
            case "doing" | "hand_in":
                self._note(wish)
            case "stop_all":
                for pupil in self._taught().pupils.values():
                    if pupil.seat is not None:
                        await self._room.stop(pupil.seat.robot)
            case "look":
                shown = self._taught().pupils.get(wish.name)
                if shown is None:
                    raise NotFound(f"there is no pupil {wish.name!r}")
                style = shown.handed or shown.style
                self.tell({"type": "looked", "id": wish.id, "name": shown.name, "style": style})

    def _open(self, wish: Member, may_teach: bool) -> None:
        """Open a class, or with its code come back to it as its teacher."""
        if not may_teach:
            raise Refused("only who may do everything with the robots opens a class")
        if wish.code:
            opened = self._room.find(wish.code)
        else:
            if len(self._room.classes) >= CLASSES_MAX:
                raise Refused(f"{CLASSES_MAX} classes are open")
            code = "".join(secrets.choice(CODE_LETTERS) for _ in range(CODE_LENGTH))
            opened = self._room.classes[code] = Class(code, wish.name.strip())
        self.leave()
        self._class = opened
        opened.teachers.add(self)
        opened.tell_teachers()

    def _join(self, wish: Member) -> None:
        name, joined = wish.name.strip(), self._room.find(wish.code)
        if not name or not name.isprintable():
            raise Refused("a name is needed")
        self.leave()
        pupil = joined.pupils.get(name)
        if pupil is not None and pupil.seat is not None:
            raise Refused(f"{name} is in the class already")
        if pupil is None:
            if len(joined.pupils) >= PUPILS_MAX:
                raise Refused(f"the class has {PUPILS_MAX} pupils")
            pupil = joined.pupils[name] = Pupil(name, self)
        pupil.seat, self._class, self._pupil = self, joined, pupil
        number = list(joined.pupils).index(name)
        self.tell({"type": "joined", "code": joined.code, "name": name, "class": joined.name, "number": number})
        joined.tell_teachers()

    def _note(self, wish: Member) -> None:
        if self._class is None or self._pupil is None:
            return
        self._pupil.doing = wish.doing
        if wish.style:
            self._pupil.style = wish.style
        if wish.do == "hand_in":
            self._pupil.handed, self._pupil.handed_stars = wish.style or self._pupil.style, wish.doing.stars
            self.tell({"type": "handed"})
        self._class.tell_teachers()

    def _taught(self) -> Class:
        if self._class is None or self not in self._class.teachers:
            raise Refused("only the teacher of the class may do that")
        return self._class

    def leave(self) -> None:
        """The page goes, or goes elsewhere; what a pupil did stays."""
        if self._class is None:
            return
        if self._pupil is not None:
            self._pupil.seat = None
        self._class.teachers.discard(self)
        left, self._class, self._pupil = self._class, None, None
        left.tell_teachers()
