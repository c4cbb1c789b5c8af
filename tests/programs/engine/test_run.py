"""One run: its events, the hand on its process, and its ends."""

from __future__ import annotations

import asyncio
import os
import signal
from typing import Any

import pytest

from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import (
    Call,
    ExitReason,
    Failed,
    Finished,
    Limits,
    Output,
)
from roboglot.programs.engine.launcher import Worker
from roboglot.programs.engine.run import Run
from roboglot.programs.engine.worker_socket import Wire
from tests.programs.playing import BUSY, PRELUDE, last, play, process_state, started, until

pytestmark = pytest.mark.asyncio(loop_scope="module")


def lines_seen(run: Run, count: int) -> set[int]:
    return {run.position.line for _ in range(count)}


async def until_seen(run: Run, lines: set[int]) -> None:
    """Watch the program move."""
    async with asyncio.timeout(60):
        while lines:
            lines -= lines_seen(run, 100)
            await asyncio.sleep(0)


async def test_a_busy_program_stops_goes_on_and_dies(engine: Engine) -> None:
    run = await started(engine, BUSY)
    await until_seen(run, {4, 5})
    for _ in range(20):
        await run.suspend()
        assert run.suspended
        assert process_state(run.pid) == "T"
        assert len(lines_seen(run, 2_000)) == 1
        await run.resume()
        assert not run.suspended
        assert process_state(run.pid) in {"R", "S"}
    await until_seen(run, {4, 5})
    await run.kill()
    assert process_state(run.pid) == ""
    assert run.exit_reason is ExitReason.KILLED
    assert run.position.line in {4, 5}
    end = await last(run)
    assert isinstance(end, Failed)
    assert end.reason is ExitReason.KILLED
    assert end.source_line in {"n += 1", "n -= 1"}


async def test_suspended_program_can_be_killed_switches_are_idempotent(engine: Engine) -> None:
    run = await started(engine, BUSY)
    await asyncio.gather(run.suspend(), run.suspend(), run.suspend())
    assert process_state(run.pid) == "T"
    await asyncio.gather(run.resume(), run.resume())
    await run.suspend()
    await asyncio.gather(run.kill(), run.kill(), run.resume(), run.suspend())
    assert process_state(run.pid) == ""
    await run.kill()
    await run.suspend()
    assert not run.suspended


async def test_reply_to_a_suspended_program_waits_for_it(engine: Engine) -> None:
    """A breakpoint: the host suspends at a call, answers, and the program goes on only when it is resumed."""
    run = await engine.start("cyberdog.task.block('b1')\nprint('after')", PRELUDE)
    call = await anext(run)
    assert isinstance(call, Call)
    assert (call.name, call.args, call.line) == ("cyberdog.task.block", ("b1",), 1)
    await run.suspend()
    run.calls.reply(call.id)
    assert run.position.line == 1
    assert process_state(run.pid) == "T"
    await run.resume()
    assert await anext(run) == Output("after\n")
    assert await last(run) == Finished()


async def test_lines_and_conditions_are_reported_where_they_stand(engine: Engine) -> None:
    source = """x = 3
while cyberdog.echo(x) > 0:
    x -= 1
    y = [
        cyberdog.echo(5),
    ]
if cyberdog.echo(0):
    pass
elif cyberdog.echo(1):
    cyberdog.echo(2)
def f():
    return cyberdog.echo(3)
f()
"""
    played = await play(engine, source)
    assert [call.line for call in played.calls] == [2, 4, 2, 4, 2, 4, 2, 7, 9, 10, 12]
    assert played.ending == Finished()


async def test_errors_carry_type_message_line_and_source(engine: Engine) -> None:
    played = await play(engine, "def f(a):\n    return 1 / a\n\nf(1)\nf(0)  # here\n")
    assert played.ending == Failed("ZeroDivisionError", "division by zero", 2, "return 1 / a", ExitReason.ERROR)
    played = await play(engine, "x = (1,\n")
    assert isinstance(played.ending, Failed)
    assert (played.ending.type, played.ending.line) == ("SyntaxError", 1)
    played = await play(engine, "class Own(Exception): pass\nraise Own('mine')")
    assert played.ending == Failed("Own", "mine", 2, "raise Own('mine')", ExitReason.ERROR)
    assert (await play(engine, "print(1)\nexit()\nprint(2)")).ending == Finished()
    assert (await play(engine, "raise SystemExit(0)")).ending == Finished()


async def test_a_killed_worker_is_a_crash(engine: Engine) -> None:
    run = await started(engine, BUSY)
    os.kill(run.pid, signal.SIGSEGV)
    end = await last(run)
    assert isinstance(end, Failed)
    assert end.reason is ExitReason.CRASHED
    assert "signal 11" in end.message


async def test_unawaited_answers_are_errors_of_the_caller(engine: Engine) -> None:
    run = await engine.start("cyberdog.echo(1)", PRELUDE)
    call = await anext(run)
    assert isinstance(call, Call)
    with pytest.raises(LookupError):
        run.calls.reply(call.id + 1)
    with pytest.raises(TypeError):
        run.calls.reply(call.id, object())
    run.calls.reply(call.id, 1)
    with pytest.raises(LookupError):
        run.calls.reply(call.id, 1)
    await run.kill()
    run.calls.reply(call.id, 1)


async def test_program_over_before_its_process_starts_is_ended(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    launch = engine._launch

    async def late(protocol: Wire, *others: Any) -> Worker:
        worker = await launch(protocol, *others)
        await until(lambda: protocol.closed)
        return worker

    monkeypatch.setattr(engine, "_launch", late)
    run = await engine.start("print('x' * 100)\nwhile True: pass", PRELUDE, Limits(output=10))
    await asyncio.wait_for(run.wait(), 30)
    assert run.exit_reason is ExitReason.OUTPUT
    assert process_state(run.pid) == ""
