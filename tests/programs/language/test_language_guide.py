"""docs/programs/language.md and its Chinese twin: every program on the page does what the page shows."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Failed
from roboglot.programs.tasks.task_run import _in_words
from tests.programs.staging import PRELUDE, Stage

DOCS = Path(__file__).parents[3] / "docs" / "programs"
SHOWN = re.compile(r"^```(python|broken)\n(.*?)^```\n\n^```output\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PROGRAM = re.compile(r"^```(?:python|broken)$", re.MULTILINE)


def shown(page: str) -> list[tuple[str, str, str]]:
    """Kind, program, and what it shows."""
    return SHOWN.findall((DOCS / page).read_text("utf-8"))


class Guide:
    """Finds out what a program on the page shows."""

    def __init__(self, engine: Engine, robot: Robot, clock: LockstepClock) -> None:
        self._engine = engine
        self._stage = Stage(engine, robot, clock)

    async def shows(self, kind: str, program: str, chinese: bool) -> str:
        if kind == "broken":
            problems = await self._engine.check(program, PRELUDE)
            return "".join(f"{p.line}:{p.column} {p.chinese if chinese else p.english}\n" for p in problems)
        assert not await self._engine.check(program, PRELUDE)
        played = await self._stage.play(program)
        return played.printed + (f"{_in_words(played.ending)}\n" if isinstance(played.ending, Failed) else "")


@pytest.mark.world("empty", body="cyberdog2")
@pytest.mark.parametrize("page", ["language.md", pytest.param("language.zh.md", marks=pytest.mark.slow)])
async def test_programs_show_what_the_page_says(page: str, robot: Robot, clock: LockstepClock) -> None:
    async with Engine() as engine:
        guide = Guide(engine, robot, clock)
        for kind, program, expected in shown(page):
            assert await guide.shows(kind, program, "zh" in page) == expected, program


def test_both_pages_have_same_programs_and_show_each() -> None:
    english, chinese = shown("language.md"), shown("language.zh.md")
    assert [found[:2] for found in english] == [found[:2] for found in chinese]
    for page, found in (("language.md", english), ("language.zh.md", chinese)):
        assert len(found) == len(PROGRAM.findall((DOCS / page).read_text("utf-8"))) > 20
