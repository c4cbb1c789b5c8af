"""The same text is judged once: while it is typed, when it is saved, and when it runs."""

from __future__ import annotations

import asyncio
from typing import cast

import pytest

from roboglot.programs.engine.engine import Engine, EngineError
from roboglot.programs.errors import EngineUnavailable
from roboglot.programs.functions.prelude import ability_set
from roboglot.programs.language import Problem, ProblemKind
from roboglot.programs.library.inspection import KEPT_CHARACTERS_MAX, KEPT_MAX, Inspector

NONE: frozenset[str] = frozenset()
WRONG = Problem(1, 1, ProblemKind.SYNTAX, "It is wrong.", "错了。")
LONG = Problem(1, 1, ProblemKind.SIZE, "It is too complicated.", "太复杂。")


class Judge:
    """An engine that notes what it is asked to look at; answers when ``ready``."""

    def __init__(self, *problems: Problem) -> None:
        self.asked: list[str] = []
        self.problems = list(problems)
        self.ready = asyncio.Event()
        self.ready.set()
        self.broken = False

    async def examine(self, source: str, _: object, *, functions: frozenset[str]) -> object:
        self.asked.append(source)
        await self.ready.wait()
        if self.broken:
            raise EngineError("it broke")
        return self.problems, functions & {"dance"}


def inspector(judge: Judge) -> Inspector:
    return Inspector(cast(Engine, judge), ability_set)


async def test_same_text_is_judged_once_for_all() -> None:
    judge = Judge(WRONG)
    judge.ready.clear()
    looks = inspector(judge)
    asking = [asyncio.create_task(looks.inspect("x = (", NONE)) for _ in range(3)]
    await asyncio.sleep(0)
    asking[0].cancel()  # its page is closed: the others still get their answers
    judge.ready.set()
    assert [await task for task in asking[1:]] == [([WRONG], NONE)] * 2
    assert await looks.inspect("x = (", NONE) == ([WRONG], NONE)
    assert judge.asked == ["x = ("]


async def test_other_modules_mean_another_judgement() -> None:
    judge = Judge()
    looks = inspector(judge)
    assert await looks.inspect("dance()", NONE) == ([], NONE)
    assert await looks.inspect("dance()", frozenset({"dance"})) == ([], frozenset({"dance"}))
    assert len(judge.asked) == 2


async def test_failures_and_excesses_are_judged_again() -> None:
    judge = Judge(LONG)
    looks = inspector(judge)
    for _ in range(2):
        assert await looks.inspect("a", NONE) == ([LONG], NONE)
    judge.broken = True
    for _ in range(2):
        with pytest.raises(EngineUnavailable):
            await looks.inspect("b", NONE)
    assert judge.asked == ["a", "a", "b", "b"]


async def test_judgements_that_are_kept_are_few_and_short() -> None:
    judge = Judge()
    looks = inspector(judge)
    for number in range(KEPT_MAX + 1):
        await looks.inspect(f"n = {number}", NONE)
    await looks.inspect("n = 0", NONE)
    long = "#" * (KEPT_CHARACTERS_MAX + 1)
    await looks.inspect(long, NONE)
    await looks.inspect(long, NONE)
    assert judge.asked[-3:] == ["n = 0", long, long]
