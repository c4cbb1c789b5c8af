"""``roboglot lesson``: plays missions of the studio; each solution must pass, each typical mistake must fail."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from roboglot.hosting.escaping import visible
from roboglot.text_files import named_text_of

if TYPE_CHECKING:
    from roboglot.console.studio.lessons import Grade, Lesson
    from roboglot.rehearsal import Rehearsals

FILE_MAX = 64 * 1024


def command(
    files: Annotated[list[Path], typer.Argument(help="Missions (TOML); examples/lessons has twenty.")],
    program: Annotated[Path | None, typer.Option(help="Try this program instead of the mission's own.")] = None,
    chinese: Annotated[bool, typer.Option("--chinese", help="Give the reasons in Chinese.")] = False,
) -> None:
    """Play missions in their own worlds, as fast as the machine can; exit with 1 if a check has another result."""
    try:
        found = [(path.stem, _lesson(path)) for path in files]
        own = None if program is None else _text(program)
    except ValueError as error:
        print(f"roboglot lesson: {visible(str(error))}", file=sys.stderr)
        raise typer.Exit(2) from None
    if not asyncio.run(_play_all(found, own, chinese)):
        raise typer.Exit(1)


def _lesson(path: Path) -> Lesson:
    from roboglot.console.studio.lessons import read

    text = _text(path)
    try:
        return read(text)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _text(path: Path) -> str:
    try:
        return named_text_of(path, FILE_MAX)
    except OSError as error:
        raise ValueError(f"cannot read {path}: {error.strerror}") from None


async def _play_all(lessons: list[tuple[str, Lesson]], own: str | None, chinese: bool) -> bool:
    from roboglot.rehearsal import Rehearsals

    rehearsals = Rehearsals()
    fine = True
    try:
        for name, lesson in lessons:
            if own is not None:
                fine &= _judge(f"{name}: your program", await _graded(rehearsals, lesson, own), "", chinese)
                continue
            fine &= _judge(f"{name}: solution", await _graded(rehearsals, lesson, lesson.solution), "", chinese)
            for number, mistake in enumerate(lesson.wrong, 1):
                grade = await _graded(rehearsals, lesson, mistake.program)
                fine &= _judge(f"{name}: mistake {number}", grade, mistake.fails, chinese)
    finally:
        await rehearsals.close()
    return fine


async def _graded(rehearsals: Rehearsals, lesson: Lesson, program: str) -> Grade:
    from roboglot.console.studio.lessons import Grade, Row, grade, no_program
    from roboglot.programs.functions.prelude import ability_set
    from roboglot.programs.language import check

    if problems := check(program, ability_set().names()):
        return no_program(problems)
    try:
        return grade(lesson, program, await rehearsals.play(program, lesson.scene, speed=0))
    except (SyntaxError, ValueError) as error:
        return Grade(0, [Row("ends", False, False, str(error), str(error))])


def _judge(what: str, grade: Grade, fails: str, chinese: bool) -> bool:
    """Print a line and the reasons. ``fails``: the check that must fail; empty: all required checks must pass."""
    failed = [row for row in grade.rows if not row.passed]
    right = grade.passed if not fails else fails in [row.kind for row in failed if not row.star]
    stars = f"{grade.stars} of 3 stars" if grade.passed else "not passed"
    expected = "" if right or not fails else f", but {fails} should have failed"
    print(f"{'ok' if right else 'WRONG':6} {visible(what)}: {stars}{expected}")
    for row in failed:
        print(f"       {row.kind}{' (star)' if row.star else ''}: {visible(row.zh if chinese else row.en)}")
    return right
