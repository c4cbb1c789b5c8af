"""Missions as data: a world, texts, allowed blocks, checks; read from teachers' TOML files."""

from __future__ import annotations

import ast
import logging
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import msgspec

from roboglot.console.studio.checks import Check, Why, Work, failure
from roboglot.model.geometry import Point, Pose
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.language import Problem
from roboglot.programs.rehearsing import Act, Played, Scene
from roboglot.spelling import meant
from roboglot.text_files import convert_toml, own_text_of, tables_in
from roboglot.validation import why_invalid

log = logging.getLogger(__name__)

LESSONS_MAX, FILE_MAX = 200, 64 * 1024
STARS_MAX = 3


class Words(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A sentence in both languages."""

    en: Annotated[str, msgspec.Meta(max_length=2000)]
    zh: Annotated[str, msgspec.Meta(max_length=2000)]


class LessonEvent(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Event during a lesson, as ``Act``."""

    at: float
    kind: str
    who: str = ""
    text: str = ""
    to: tuple[float, float] = (0.0, 0.0)


class TypicalMistake(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A typical mistake, and the kind of the check that finds it ("ends" also for an invalid program)."""

    program: str
    fails: str


class Lesson(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One mission. ``start`` is x, y in m and degrees; ``boxes`` are x, y and two sizes; ``people`` x, y, degrees.

    ``allowed``: the toolbox's blocks, empty for all; ``blocks``: the blocks at the beginning.
    """

    title: Words
    task: Words
    check: Annotated[list[Check], msgspec.Meta(min_length=1, max_length=20)]
    solution: str
    world: str = "empty"
    start: tuple[float, float, float] = (2.0, 5.0, 0.0)
    boxes: Annotated[list[tuple[float, float, float, float]], msgspec.Meta(max_length=50)] = []
    people: dict[str, tuple[float, float, float]] = {}
    happens: Annotated[list[LessonEvent], msgspec.Meta(max_length=50)] = []
    goals: list[tuple[float, float]] = []
    longest: Annotated[float, msgspec.Meta(gt=0, le=600)] = 60.0
    allowed: list[str] = []
    blocks: list[str] = []
    hints: Annotated[list[Words], msgspec.Meta(max_length=5)] = []
    wrong: list[TypicalMistake] = []

    def __post_init__(self) -> None:
        functions = {operation.key for operation in ABILITIES}
        named = [*self.blocks, *(block for block in self.allowed if block.startswith("cyberdog."))]
        if unknown := next((block for block in named if block not in functions), ""):
            raise ValueError(f"there is no function {unknown!r}{meant(unknown, functions)}")

    @property
    def scene(self) -> Scene:
        """Scene in which its programs are played."""
        x, y, degrees = self.start
        return Scene(
            world=self.world,
            start=Pose(x, y, math.radians(degrees)),
            boxes=tuple((Pose(bx, by), (sx, sy, 0.6)) for bx, by, sx, sy in self.boxes),
            people=tuple((name, Pose(px, py, math.radians(pd))) for name, (px, py, pd) in self.people.items()),
            acts=tuple(Act(h.at, h.kind, h.who, h.text, h.to) for h in self.happens),
            longest=self.longest,
        )


class Row(msgspec.Struct, frozen=True):
    """One check's outcome."""

    kind: str
    star: bool
    passed: bool
    en: str = ""
    zh: str = ""


class Grade(msgspec.Struct, frozen=True):
    """A mission's outcome: stars from 0 to 3, 0 for not passed, and a row for each check."""

    stars: int
    rows: list[Row]

    @property
    def passed(self) -> bool:
        """True if all required checks were met."""
        return self.stars > 0


def grade(lesson: Lesson, source: str, played: Played) -> Grade:
    """Return the grade of a program's play."""
    outlines = [*played.outlines, *(_box(*box) for box in lesson.boxes)]
    work = Work(played, ast.parse(source), outlines, lesson.start[:2])
    rows = [_row(check, failure(check, work)) for check in [Check(kind="ends"), *lesson.check]]
    return Grade(_stars(rows), rows)


def no_program(problems: Sequence[Problem]) -> Grade:
    """Return the grade of a text that is not a program."""
    first = problems[0]
    words = f"line {first.line}: {first.english}", f"第 {first.line} 行：{first.chinese}"
    return Grade(0, [Row("ends", False, False, *words)])


def _row(check: Check, why: Why | None) -> Row:
    return Row(check.kind, check.star, why is None, *((why.en, why.zh) if why else ("", "")))


def _stars(rows: Sequence[Row]) -> int:
    if not all(row.passed for row in rows if not row.star):
        return 0
    extra = [row.passed for row in rows if row.star]
    return STARS_MAX - min(STARS_MAX - 1, extra.count(False))


def _box(x: float, y: float, width: float, depth: float) -> list[Point]:
    w, d = width / 2, depth / 2
    return [Point(x - w, y - d), Point(x + w, y - d), Point(x + w, y + d), Point(x - w, y + d)]


def read(text: str) -> Lesson:
    """Return the lesson of a file's text. Raises ValueError in plain words."""
    try:
        return convert_toml(text, Lesson)
    except msgspec.ValidationError as error:
        raise ValueError(why_invalid(error, "the mission", wanted=Lesson)) from None


def load(folders: Sequence[Path]) -> dict[str, Lesson]:
    """Return all missions of these folders by file name, in order; unreadable ones are logged and skipped."""
    found: dict[str, Lesson] = {}
    for folder in folders:
        for path in tables_in(folder)[:LESSONS_MAX] if folder.is_dir() else ():
            try:
                found[path.stem] = read(own_text_of(path, FILE_MAX))
            except (OSError, ValueError) as error:
                log.warning("left out the lesson %s: %s", path, error)
    return found


def shown(lessons: Mapping[str, Lesson]) -> list[dict[str, object]]:
    """Return the lessons for pages, without the solutions."""
    hidden = {"solution", "wrong"}
    return [
        {"id": id, **{key: value for key, value in msgspec.to_builtins(lesson).items() if key not in hidden}}
        for id, lesson in lessons.items()
    ]
