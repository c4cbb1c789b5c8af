"""A run that was lost goes on from what it was answered."""

from __future__ import annotations

import os
import signal

import pytest

from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Answer as Replied
from roboglot.programs.engine.events import (
    Call,
    ExitReason,
    Failed,
    Output,
    Replayed,
)
from roboglot.programs.engine.run import Run
from tests.programs.playing import PRELUDE, Answer, play

pytestmark = pytest.mark.asyncio(loop_scope="module")


LIFE = """import random
total = 0
for i in range(6):
    total += cyberdog.echo(random.randint(1, 1000))
    print(i, total)
try:
    cyberdog.motion.turn(1)
except ValueError as error:
    print('caught', error)
print('end', cyberdog.echo('x'))
"""


def life(heard: list[Replied], limit: int = 99) -> tuple[list[Call], Answer]:
    """Answers that also keep the history; the run is lost after ``limit`` answers."""
    calls: list[Call] = []

    def answer(run: Run, call: Call) -> None:
        run.calls.answered = lambda name, body: heard.append(Replied(name, body))
        calls.append(call)
        if len(heard) == limit:
            os.kill(run.pid, signal.SIGKILL)
        elif call.name.endswith("turn"):
            run.calls.fail(call.id, "ValueError", "no")
        else:
            run.calls.reply(call.id, call.args[0])

    return calls, answer


@pytest.mark.parametrize("lost_after", [0, 1, 4, 6, 7])
async def test_a_lost_run_goes_on_from_its_history(engine: Engine, lost_after: int) -> None:
    """Wherever it was lost, in its second life it does what it would have done, and asks nothing twice."""
    whole = await play(engine, LIFE, life([])[1])
    heard: list[Replied] = []
    first, answer = life(heard, lost_after)
    broken = await play(engine, LIFE, answer)
    assert isinstance(broken.ending, Failed)
    assert len(heard) == lost_after
    run = await engine.start(LIFE, PRELUDE, seed=1, history=list(heard))
    second, answer = life(heard)
    text, replayed = "", []
    async for event in run:
        match event:
            case Output(text=piece):
                text += piece
            case Replayed():
                replayed.append(event.name)
            case Call():
                answer(run, event)
    assert run.exit_reason is ExitReason.FINISHED
    assert text == whole.output
    assert [call.args for call in [*first[:lost_after], *second]] == [call.args for call in whole.calls]
    assert replayed == [call.name for call in first[:lost_after]]


async def test_program_that_diverges_on_replay_is_ended(engine: Engine) -> None:
    run = await engine.start(
        "cyberdog.echo(1)\ncyberdog.motion.turn(2)",
        PRELUDE,
        history=[Replied("cyberdog.echo", b'{"t":"value","value":1}'), Replied("cyberdog.echo", b"")],
    )
    events = [event async for event in run]
    assert isinstance(events[-1], Failed)
    assert events[-1].reason is ExitReason.DIVERGED
    assert not any(isinstance(event, Call) for event in events)
