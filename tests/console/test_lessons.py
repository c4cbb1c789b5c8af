"""examples/lessons: each mission's solution passes with all stars, each typical mistake fails for the right reason."""

from __future__ import annotations

import ast
import asyncio
import gc
import re
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
import typer

from roboglot.cli.programs.lesson import command
from roboglot.console.studio.blocks import table
from roboglot.console.studio.checks import Check, Work, failure
from roboglot.console.studio.lessons import Grade, Lesson, grade, load, read
from roboglot.console.studio.mistakes import explain
from roboglot.console.studio.programs import FOLDER
from roboglot.programs.functions.table import call
from roboglot.programs.rehearsing import Played, Scene, Spot
from roboglot.rehearsal import Rehearsals

LESSONS = load([FOLDER])
pytestmark = pytest.mark.asyncio(loop_scope="module")


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def rehearsals() -> AsyncIterator[Rehearsals]:
    made = Rehearsals()
    yield made
    await made.close()


def _own(words: str) -> str:
    """Return the words without what they quote of the mission."""
    return re.sub("“[^”]*”", "“”", words)


async def graded(rehearsals: Rehearsals, lesson: Lesson, program: str) -> Grade:
    return grade(lesson, program, await rehearsals.play(program, lesson.scene, speed=0))


async def test_there_are_twenty_with_three_mistakes_each() -> None:
    assert len(LESSONS) == len(list(FOLDER.glob("*.toml"))) == 20
    assert [name for name, lesson in LESSONS.items() if len(lesson.wrong) != 3 or not lesson.hints] == []


# Every sixth lesson is always played, with its mistakes; the others after changes of lessons and of the language.
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if i % 6 == 3 else pytest.mark.slow) for i, name in enumerate(LESSONS)]
)
async def test_the_solution_passes_and_mistakes_fail(rehearsals: Rehearsals, name: str) -> None:
    lesson = LESSONS[name]
    found = await graded(rehearsals, lesson, lesson.solution)
    assert [row for row in found.rows if not row.passed] == []
    assert found.stars == 3
    for mistake in lesson.wrong:
        found = await graded(rehearsals, lesson, mistake.program)
        assert not found.passed, mistake.program
        failed = {row.kind: row for row in found.rows if not row.passed and not row.star}
        assert mistake.fails in failed, (mistake.program, found.rows)
        for row in failed.values():
            assert re.fullmatch(r"(?:[^.]|\.\d)*\.", _own(row.en)), row.en  # one sentence
            assert re.fullmatch("[^a-zA-Z。]*。", _own(row.zh)), row.zh


TEN_LINES = """
title = { en = "Bark", zh = "叫" }
task = { en = "Bark once.", zh = "叫一声。" }
solution = "cyberdog.audio.offline_play(4000)"
[[check]]
kind = "say"
text = "bark"
"""


async def test_a_teacher_writes_one_in_ten_lines(rehearsals: Rehearsals) -> None:
    lesson = read(TEN_LINES)
    assert (await graded(rehearsals, lesson, lesson.solution)).stars == 3
    assert (await graded(rehearsals, lesson, "x = 1")).rows[-1].en == "The dog said nothing."


@pytest.mark.parametrize("how", ["called off", "closed"])
async def test_a_play_leaves_no_call_behind(how: str) -> None:
    made, sleeps, printed = Rehearsals(), asyncio.Event(), asyncio.Event()

    def notice(news: dict[str, object]) -> None:
        if news["what"] == "print":
            printed.set()
        elif printed.is_set():
            sleeps.set()

    playing = asyncio.ensure_future(made.play("print(1)\ntime.sleep(9)", Scene(), speed=1.0, notice=notice))
    await asyncio.wait_for(sleeps.wait(), 60)
    if how == "called off":
        playing.cancel()
        await made.play("", Scene(), speed=0)  # in its turn: the other has ended
    else:
        await made.close()
    tasks = [one for one in gc.get_objects() if isinstance(one, asyncio.Task) and not one.done()]
    assert [task for task in tasks if getattr(task.get_coro(), "__name__", "") == call.__name__] == []
    await made.close()


async def test_an_endless_program_is_ended(rehearsals: Rehearsals) -> None:
    lesson = read(TEN_LINES.replace("solution", "longest = 2.0\nsolution"))
    found = await graded(rehearsals, lesson, "while True:\n    time.sleep(1)\n")
    assert [row.en for row in found.rows if not row.passed] == [
        "The program did not come to its end.",
        "The dog said nothing.",
    ]


def printing(pattern: str) -> str:
    return TEN_LINES.replace('"say"', '"print"').replace('"bark"', f'"{pattern}"')


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ("x = 1", "x is unknown"),
        (TEN_LINES + "metre = 3", r"check\[0\].metre is unknown"),
        (TEN_LINES.replace('"say"', '"fly"'), r"check\[0\].kind cannot be 'fly'"),
        (TEN_LINES.replace("[[check]]", "[check]"), "check must be a list, not an object"),
        ("title = [", "Invalid value"),
        (printing("("), "a printed text is a regular expression: missing"),
        ('blocks = ["cyberdog.motion.go_strait"]' + TEN_LINES, "did you mean 'cyberdog.motion.go_straight'"),
        ('allowed = ["forever", "cyberdog.motion.go"]' + TEN_LINES, "no function 'cyberdog.motion.go'"),
    ],
)
async def test_bad_missions_are_refused_with_the_reason(wrong: str, why: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=why):
        read(wrong)
    (tmp_path / "bad.toml").write_text(wrong, "utf-8")
    (tmp_path / "good.toml").write_text(TEN_LINES, "utf-8")
    assert list(load([tmp_path])) == ["good"]  # the others are there all the same


async def test_reasons_say_no_number_that_would_do() -> None:
    """Round nothing that was missed by a hair to what is wanted."""
    path = [Spot(0.0, 0.0, 0.0, 0.0), Spot(1.0, 0.4999, 0.0, 0.0)]
    work = Work(Played(path=path, seconds=5.01), ast.parse("x = 1"), [], (0.0, 0.0))
    checks = [Check(kind="move", metres=0.5), Check(kind="within", seconds=5), Check(kind="light", text="red")]
    assert [why and why.en for why in (failure(check, work) for check in checks)] == [
        "The dog walked 0.49 m; at least 0.5 are needed.",
        "It took 5.1 s; 5 are allowed.",
        "No light was red.",
    ]


async def test_errors_name_the_missing_and_the_meant() -> None:
    """Name them apart."""
    found = explain("AttributeError: 'cyberdog.audio' has no 'ply'; did you mean 'play'? (line 2: a.ply())")
    assert (found["en"], found["line"]) == ("There is no ply here. Did you mean play?", 2)
    found = explain("AttributeError: 'cyberdog.audio.play' cannot be changed (line 1: x)")
    assert found["zh"] == "程序里不能使用或更改 cyberdog.audio.play。"


async def test_the_command_plays_a_mission_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "bark.toml"
    file.write_text(TEN_LINES + '[[wrong]]\nfails = "say"\nprogram = "x = 1"\n', "utf-8")
    await asyncio.to_thread(command, [file])
    assert capsys.readouterr().out.splitlines() == [
        "ok     bark: solution: 3 of 3 stars",
        "ok     bark: mistake 1: not passed",
        "       say: The dog said nothing.",
    ]
    file.write_text(TEN_LINES + '[[wrong]]\nfails = "reach"\nprogram = "x = 1"\n', "utf-8")
    with pytest.raises(typer.Exit) as left:
        await asyncio.to_thread(command, [file])
    assert left.value.exit_code == 1
    assert "mistake 1: not passed, but reach should have failed" in capsys.readouterr().out


async def test_blocks_of_beginners_stand_first_and_do_something() -> None:
    functions = {f["key"]: f["parameters"] for f in table()["functions"] if f["group"] == "motion"}
    names = [key.rpartition(".")[2] for key in functions]
    assert [*names[:2], names[-1]] == ["go_straight", "turn", "emergency_stop"]
    started = [(p["minimum"], p["start"], p["maximum"]) for ps in functions.values() for p in ps if "start" in p]
    assert len(started) == 4
    assert all(low <= value <= high and value for low, value, high in started)
