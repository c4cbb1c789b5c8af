"""Stepping and stopping at lines: a watched program halts where it is asked to, and nowhere else."""

from __future__ import annotations

import pytest

from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import (
    Answer,
    Call,
    ExitReason,
    Failed,
    Finished,
    Halted,
    Output,
    Stops,
)
from roboglot.programs.engine.run import Run
from roboglot.programs.language.places import Step
from tests.programs.playing import PRELUDE, process_state

pytestmark = pytest.mark.asyncio(loop_scope="module")

LOOP = """total = 0

for n in range(3):
    total += n

    print(total)
def twice(x):
    '''Words.'''
    return 2 * x
print(twice(total))
"""


def stops(*lines: int, first: bool = False) -> Stops:
    return Stops(frozenset(("", line) for line in lines), first=first)


async def walked(run: Run, *, step: bool = True) -> tuple[list[int], str]:
    """Let it go on from every halt; the lines at which it halted, and what it printed."""
    lines, text = [], ""
    async for event in run:
        match event:
            case Halted(id=id, line=line):
                assert run.position.line == line
                lines.append(line)
                if step:
                    run.position.step()
                run.calls.reply(id)
            case Output(text=more):
                text += more
    return lines, text


async def test_every_statement_is_a_step(engine: Engine) -> None:
    run = await engine.start(LOOP, PRELUDE, stops=stops(first=True))
    lines, text = await walked(run)
    assert lines == [1, 3, *(4, 6) * 3, 7, 10, 9]
    assert text == "0\n1\n3\n6\n"
    assert run.exit_reason is ExitReason.FINISHED


@pytest.mark.parametrize(
    ("at", "halts"),
    [((4,), [4, 4, 4]), ((5,), [6, 6, 6]), ((8,), [9]), ((2, 10), [3, 10]), ((1,), [1]), ((), [])],
)
async def test_halts_at_breakpoints_or_the_next_statement(
    engine: Engine, at: tuple[int, ...], halts: list[int]
) -> None:
    run = await engine.start(LOOP, PRELUDE, stops=stops(*at))
    lines, text = await walked(run, step=False)
    assert (lines, text) == (halts, "0\n1\n3\n6\n")


async def test_lines_that_are_not_there(engine: Engine) -> None:
    for wrong in (stops(0), stops(99), Stops(frozenset({("m", 1)}))):
        with pytest.raises(LookupError):
            await engine.start(LOOP, PRELUDE, stops=wrong)


async def test_lines_of_modules(engine: Engine) -> None:
    modules = {"m": "def m():\n    return 1\n"}
    run = await engine.start("print(m())", PRELUDE, modules=modules, stops=Stops(frozenset({("m", 2)})))
    event = await anext(run)
    assert event == Halted(1, 2, "m")
    assert (run.position.unit, run.position.line) == ("m", 2)
    await run.kill()


async def test_busy_program_is_halted_and_its_stops_change(engine: Engine) -> None:
    run = await engine.start("print(1)\nn = 0\nwhile True:\n    n += 1\n    n -= 1\n", PRELUDE, stops=Stops())
    assert await anext(run) == Output("1\n")
    run.position.step()
    halted = await anext(run)
    assert isinstance(halted, Halted)
    run.position.stop_at([("", 5)])
    run.calls.reply(halted.id)
    for _ in range(3):
        halted = await anext(run)
        assert isinstance(halted, Halted)
        assert halted.line == 5
        run.calls.reply(halted.id)
    halted = await anext(run)
    assert isinstance(halted, Halted)
    run.position.stop_at([("", 4)])
    await run.suspend()
    assert process_state(run.pid) == "T"
    run.calls.reply(halted.id)
    await run.resume()
    assert await anext(run) == Halted(halted.id + 1, 4)
    await run.suspend()
    await run.kill()
    assert process_state(run.pid) == ""


CALLS = """def inner(n):
    print(n)
    return n + 1
def outer(n):
    n = inner(n)
    n = inner(n)
    return n
print(outer(1))
n = outer(5) + inner(7)
def down(n):
    if n:
        down(n - 1)
    print("d")
down(2)
print("end")
"""


async def halts_after(engine: Engine, at: int, *steps: Step) -> list[int]:
    """Halt at a line first, then take these steps; the lines at which it halted."""
    run = await engine.start(CALLS, PRELUDE, stops=stops(at))
    lines: list[int] = []
    async for event in run:
        if isinstance(event, Halted):
            lines.append(event.line)
            if len(lines) > len(steps):
                break
            run.position.stop_at([])
            run.position.step(steps[len(lines) - 1])
            run.calls.reply(event.id)
    await run.kill()
    return lines


async def test_a_step_over_passes_what_is_called(engine: Engine) -> None:
    over, out, into = Step.OVER, Step.OUT, Step.INTO
    assert await halts_after(engine, 5, over, over, over, over) == [5, 6, 7, 9, 10]  # from its end to its caller
    assert await halts_after(engine, 2, out, into, out, out, over) == [2, 6, 2, 7, 9, 10]
    assert await halts_after(engine, 12, over, over) == [12, 13, 15]  # recursive calls, too
    assert await halts_after(engine, 11, over, into, over, over, out) == [11, 12, 11, 12, 13, 13]
    assert await halts_after(engine, 15, out) == [15]


async def test_stop_counts_inside_of_what_step_passes(engine: Engine) -> None:
    run = await engine.start(CALLS, PRELUDE, stops=stops(2, 8))
    lines = []
    async for event in run:
        if isinstance(event, Halted):
            lines.append(event.line)
            run.position.step(Step.OVER)
            run.calls.reply(event.id)
            if len(lines) == 4:
                break
    await run.kill()
    assert lines == [8, 2, 3, 6]


async def test_run_that_no_one_watches_does_not_halt(engine: Engine) -> None:
    run = await engine.start(LOOP, PRELUDE)
    run.position.step()
    run.position.stop_at([("", 4)])
    assert await walked(run) == ([], "0\n1\n3\n6\n")


async def test_replayed_statements_do_not_halt(engine: Engine) -> None:
    source = "print(cyberdog.echo(1))\nprint(cyberdog.echo(2))\nprint(3)\n"
    history = [Answer("cyberdog.echo", b'{"t":"value","value":7}')]
    run = await engine.start(source, PRELUDE, history=history, stops=stops(1, 2, 3))
    seen = [event async for event in run if not isinstance(event, Output) and _go_on(run, event)]
    assert [event.line for event in seen if isinstance(event, Halted)] == [2, 3]


def _go_on(run: Run, event: object) -> bool:
    if isinstance(event, (Call, Halted)):
        run.calls.reply(event.id)
    return True


async def test_halt_that_no_one_asked_for_breaks_protocol() -> None:
    forged = (
        "import os\n"
        'body = b\'{"t":"call","id":1,"name":"$halt","args":[],"kwargs":{}}\'\n'
        "os.write(3, len(body).to_bytes(4, 'big') + body)\nwhile True: pass\n"
    )
    async with Engine(policy=False) as open_engine:
        run = await open_engine.start(forged, PRELUDE)
        [end] = [event async for event in run]
        assert isinstance(end, Failed)
        assert end.reason is ExitReason.PROTOCOL
        watched = await open_engine.start(forged, PRELUDE, stops=Stops())
        halted = await anext(watched)  # as harmless as a block that suspends
        assert isinstance(halted, Halted)
        await watched.kill()


async def test_errors_and_ends_are_as_without(engine: Engine) -> None:
    run = await engine.start("def f():\n    return f()\nf()\n", PRELUDE, stops=stops())
    [end] = [event async for event in run]
    assert isinstance(end, Failed)
    assert (end.type, end.line, end.reason) == ("RecursionError", 2, ExitReason.ERROR)
    run = await engine.start("pass", PRELUDE, stops=stops(1))
    assert await anext(run) == Halted(1, 1)
    run.calls.reply(1)
    assert [event async for event in run] == [Finished()]
