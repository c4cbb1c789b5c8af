"""Values between a program and its host: errors, time, names and modules too."""

from __future__ import annotations

import asyncio
import random

import pytest

from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import (
    Call,
    ExitReason,
    Failed,
    Finished,
)
from roboglot.programs.engine.run import Run
from roboglot.programs.worker.frames import frame
from roboglot.programs.worker.values import Record
from tests.programs.playing import PRELUDE, answers, echo, last, play

pytestmark = pytest.mark.asyncio(loop_scope="module")


async def test_modules_share_the_program_and_own_their_lines(engine: Engine) -> None:
    modules = {
        "m1": "def say(x):\n    return cyberdog.echo(x) * 2\n",
        "m2": "def twice(x):\n    return say(say(x)) / 0\n",
    }
    played = await play(engine, "print(say(4))\ntwice(1)\n", modules=modules)
    assert played.output == "8\n"
    assert [(call.unit, call.line) for call in played.calls] == [("m1", 2)] * 3
    assert played.ending == Failed(
        "ZeroDivisionError", "division by zero", 2, "return say(say(x)) / 0", ExitReason.ERROR, "m2"
    )
    broken = await play(engine, "pass", modules={"m": "def ("})
    assert isinstance(broken.ending, Failed)
    assert broken.ending.unit == "m"


async def test_values_cross_both_ways(engine: Engine) -> None:
    source = """
import math
for v in [None, True, 1, -2.5, 2**80, '狗', [1, [2]], {'a': 1}, {1: 'x', (2, 3): None}, math.inf]:
    assert cyberdog.echo(v) == v, v
assert math.isnan(cyberdog.echo(math.nan))
assert cyberdog.echo((1, 2)) == [1, 2]
g = Gait(name='g')
g.points.push_back(Point(x=1.5))
g.points[0].y = 2
g.points[0].y += 1
p = Point()
g.points.push_back(p)
p.x = 99
assert g.points.size() == 3 and g.points.back().x == 0.0 and g.points.front() == Point(y=3)
assert cyberdog.echo(g) == g and cyberdog.echo(g).points.at(1).x == 1.5
for bad in [print, 3j, {1}, g.points.at]:
    try:
        cyberdog.echo(bad)
        print('crossed', bad)
    except TypeError as e:
        pass
try:
    g.nothing = 1
    print('undeclared')
except AttributeError:
    pass
r = cyberdog.motion.turn(10, duration=2)
print(r.state.code == StateCode.fail, r.state.state.describe, r.list.size(), end=' ')
print(r.response.has_key('张三'), r.dictionary['张三'])
print(cyberdog.motion.state.code, r)
"""

    def answer(run: Run, call: Call) -> None:
        if call.name == "cyberdog.motion.turn":
            assert (call.args, call.kwargs) == ((10,), {"duration": 2})
            state = Record("State", {"code": 1, "describe": "失败"})
            run.calls.reply(call.id, Record("Reply", {"state": state, "dictionary": {"张三": 7}}))
        elif call.name == "cyberdog.motion.state":
            assert not call.args
            run.calls.reply(call.id, Record("State"))
        else:
            echo(run, call)

    played = await play(engine, source, answer)
    assert played.ending == Finished()
    assert played.output == (
        "True 失败 2 True 7\n0 Reply(state=State(code=1, describe='失败'), list=[1, 2], dictionary={'张三': 7})\n"
    )


async def test_host_errors_are_exceptions_in_the_program(engine: Engine) -> None:
    source = """
for f in (cyberdog.motion.turn, cyberdog.motion.go_straight):
    try:
        f(1)
    except ValueError as e:
        print('value', e)
    except RobotError as e:
        print(type(e).__name__, e)
cyberdog.echo()
"""

    class MotionRefused(Exception):
        pass

    answer = answers(turn=ValueError("坏"), go_straight=MotionRefused("no legs"), echo=TimeoutError("late"))
    played = await play(engine, source, answer)
    assert played.output == "value 坏\nMotionRefused no legs\n"
    assert played.ending == Failed("TimeoutError", "late", 9, "cyberdog.echo()", ExitReason.ERROR)


async def test_time_is_the_robots(engine: Engine) -> None:
    source = (
        "import time as t\nt.sleep(2.5)\nprint(t.time(), t.localtime().tm_min, time.strftime('%H:%M'), t.monotonic())"
    )
    played = await play(engine, source, answers(sleep=None, time=1000.0, monotonic=5))
    assert played.output == "1000.0 16 00:16 5.0\n"
    assert [(call.name, call.args) for call in played.calls] == [
        ("time.sleep", (2.5,)),
        *[("time.time", ())] * 3,
        ("time.monotonic", ()),
    ]


async def test_a_seed_repeats_a_run(engine: Engine) -> None:
    source = """import random
print(random.random(), random.sample(range(99), 3), {'a', 'b', 'c'})
random.seed()
print(random.random())"""
    first, second, other = [(await play(engine, source, seed=seed)).output for seed in (7, 7, 8)]
    assert first == second != other
    assert str(random.Random(7).random()) in first


async def test_misspelt_names_say_what_was_meant(engine: Engine) -> None:
    played = await play(engine, "cyberdog.motion.trun(1)")
    assert isinstance(played.ending, Failed)
    assert "did you mean 'turn'" in played.ending.message
    problems = await engine.check(
        "cyberdog.motion.trun(1)\nsay(1)\nStateCode.fayl", PRELUDE, functions=frozenset({"say"})
    )
    assert [(problem.line, problem.english) for problem in problems] == [
        (1, "'cyberdog.motion' has no 'trun'. Did you mean 'turn'?"),
        (3, "'StateCode' has no 'fayl'. Did you mean 'fail'?"),
    ]


async def test_surrogates_and_controls_are_only_text(engine: Engine) -> None:
    played = await play(engine, r"print('a\udc80b\0\x1b狗', cyberdog.echo('\ud800'))")
    assert played.output == "a?b\0\x1b狗 ?\n"


async def test_short_calls_are_answered_as_they_come(engine: Engine) -> None:
    source = "for i in range(3):\n    cyberdog.echo(i)\ncyberdog.echo([3])\ncyberdog.echo('x' * 300)\n"
    run, at_once, read = await engine.start(source, PRELUDE), list[object](), list[object]()

    def answer(call: Call) -> None:
        at_once.append(call.args)
        run.calls.reply(call.id)

    run.calls.asked = answer
    async for event in run:
        if isinstance(event, Call):
            read.append((event.args, event.line))
            run.calls.reply(event.id)
    assert at_once[-2:] == [(1,), (2,)]  # the first may have come before
    assert read[-2:] == [(([3],), 3), (("x" * 300,), 4)]
    assert run.exit_reason is ExitReason.FINISHED


async def test_two_calls_at_once_are_a_violation(engine: Engine) -> None:
    run = await engine.start("while True:\n    pass\n", PRELUDE)
    asked = list[Call]()
    run.calls.asked = asked.append
    reading = asyncio.create_task(last(run))
    await asyncio.sleep(0)
    call = b'{"t":"call","id":%d,"name":"cyberdog.echo","args":[],"kwargs":{}}'
    run.wire.data_received(frame(call % 1))
    assert [call.id for call in asked] == [1]
    run.calls.reply(1)
    run.wire.data_received(frame(call % 2) + frame(call % 3))
    assert [call.id for call in asked] == [1]
    end = await reading
    assert isinstance(end, Failed)
    assert end.reason is ExitReason.PROTOCOL
