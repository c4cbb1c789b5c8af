"""One run: its events, the hand on its process, its limits and its ends."""

from __future__ import annotations

import asyncio
import os
import random
import signal

import pytest
from playing import PRELUDE, Answer, answers, echo, play, process_state, until

from roboglot.programs.engine import Engine
from roboglot.programs.events import Answer as Replied
from roboglot.programs.events import Call, ExitReason, Failed, Finished, Limits, Output, Replayed
from roboglot.programs.run import Run
from roboglot.programs.worker.values import Record

pytestmark = pytest.mark.asyncio(loop_scope="module")

BUSY = "n = 0\nprint('ready')\nwhile True:\n    n += 1\n    n -= 1\n"


async def started(engine: Engine, source: str, limits: Limits | None = None) -> Run:
    """A run that has printed its first word."""
    run = await engine.start(source, PRELUDE, limits or Limits())
    assert isinstance(await anext(run), Output)
    return run


async def last(run: Run) -> Finished | Failed:
    async for event in run:
        if isinstance(event, (Finished, Failed)):
            return event
    raise AssertionError("the run ended without a last event")


def lines_seen(run: Run, count: int) -> set[int]:
    return {run.line for _ in range(count)}


async def until_seen(run: Run, lines: set[int]) -> None:
    """Watch the program move; hangs if it doesn't."""
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
    assert run.line in {4, 5}
    end = await last(run)
    assert isinstance(end, Failed)
    assert end.reason is ExitReason.KILLED
    assert end.source_line in {"n += 1", "n -= 1"}


async def test_a_suspended_program_can_be_killed_and_switches_are_idempotent(engine: Engine) -> None:
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


async def test_a_reply_to_a_suspended_program_waits_for_it(engine: Engine) -> None:
    """A breakpoint: the host suspends at a call, answers, and the program goes on only when it is resumed."""
    run = await engine.start("cyberdog.task.block('b1')\nprint('after')", PRELUDE)
    call = await anext(run)
    assert isinstance(call, Call)
    assert (call.name, call.args, call.line) == ("cyberdog.task.block", ("b1",), 1)
    await run.suspend()
    run.reply(call.id)
    assert run.line == 1
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
            run.reply(call.id, Record("Reply", {"state": state, "dictionary": {"张三": 7}}))
        elif call.name == "cyberdog.motion.state":
            assert not call.args
            run.reply(call.id, Record("State"))
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


async def test_limits_name_themselves(engine: Engine) -> None:
    small = 32 * 1024 * 1024
    memory = await play(
        engine, "x = []\nwhile True:\n    x.append('a' * 1000 + str(len(x)))", limits=Limits(memory=small)
    )
    cpu = await play(engine, "while True: pass", limits=Limits(cpu=1))
    output = await play(engine, "while True: print('x' * 50)", limits=Limits(output=10_000))
    recursion = await play(engine, "def f(n): return f(n + 1)\nf(0)", limits=Limits(recursion=100))
    reasons = [played.ending.reason for played in (memory, cpu, output, recursion) if isinstance(played.ending, Failed)]
    assert reasons == [ExitReason.MEMORY, ExitReason.CPU, ExitReason.OUTPUT, ExitReason.ERROR]
    assert isinstance(recursion.ending, Failed)
    assert recursion.ending.type == "RecursionError"
    assert len(output.output) <= 10_000


async def test_calls_at_the_depth_limit_do_not_break_off(engine: Engine) -> None:
    """Wherever the limit strikes, the program can go on calling: request and reply stay in step."""
    source = """
def deep(n):
    try:
        cyberdog.echo(n)
        deep(n + 1)
    except RecursionError:
        assert cyberdog.echo(-n) == -n
deep(1)
print(cyberdog.echo('fine'))
"""
    played = await play(engine, source, limits=Limits(recursion=150, call_rate=100_000))
    assert played.ending == Finished()
    assert played.output == "fine\n"


async def test_a_quota_of_memory_is_really_there(engine: Engine) -> None:
    played = await play(
        engine, "x = bytearray(24 * 1024 * 1024)\nprint(len(x))", limits=Limits(memory=32 * 1024 * 1024)
    )
    assert played.ending == Finished()


async def test_calls_above_the_rate_are_slowed_down_not_ended(engine: Engine) -> None:
    """100 calls may come at once; the other 200 take a fifth of a second at 1000 a second."""
    loop = asyncio.get_running_loop()
    before = loop.time()
    played = await play(engine, "for i in range(300): cyberdog.echo(i)", limits=Limits(call_rate=1000))
    assert played.ending == Finished()
    assert len(played.calls) == 300
    assert loop.time() - before >= 0.19


async def test_thousands_of_outputs_arrive_whole_and_joined(engine: Engine) -> None:
    run = await engine.start("for i in range(5000): print(i)", PRELUDE)
    texts = [event.text async for event in run if isinstance(event, Output)]
    assert "".join(texts) == "".join(f"{i}\n" for i in range(5000))
    assert len(texts) < 2500


async def test_a_slow_reader_makes_the_program_wait(engine: Engine) -> None:
    """Nothing piles up in the server: the socket fills and the program blocks in print."""
    run = await engine.start(
        "for i in range(400): print(str(i) * 20000)\ncyberdog.echo()", PRELUDE, Limits(output=10**9)
    )
    await until(lambda: process_state(run.pid) == "S" and run.line == 1)
    size = 0
    async for event in run:
        match event:
            case Output(text=text):
                size += len(text)
            case Call():
                run.reply(event.id)
    assert size == sum(len(str(i)) * 20000 + 1 for i in range(400))
    assert run.exit_reason is ExitReason.FINISHED


async def test_a_killed_worker_is_a_crash(engine: Engine) -> None:
    run = await started(engine, BUSY)
    os.kill(run.pid, signal.SIGSEGV)
    end = await last(run)
    assert isinstance(end, Failed)
    assert end.reason is ExitReason.CRASHED
    assert "signal 11" in end.message


async def test_answers_nobody_waits_for_are_errors_of_the_caller(engine: Engine) -> None:
    run = await engine.start("cyberdog.echo(1)", PRELUDE)
    call = await anext(run)
    assert isinstance(call, Call)
    with pytest.raises(LookupError):
        run.reply(call.id + 1)
    with pytest.raises(TypeError):
        run.reply(call.id, object())
    run.reply(call.id, 1)
    with pytest.raises(LookupError):
        run.reply(call.id, 1)
    await run.kill()
    run.reply(call.id, 1)


async def test_surrogates_and_controls_are_only_text(engine: Engine) -> None:
    played = await play(engine, r"print('a\udc80b\0\x1b狗', cyberdog.echo('\ud800'))")
    assert played.output == "a?b\0\x1b狗 ?\n"


async def test_a_run_has_a_time_limit_that_stands_still_while_it_is_suspended(engine: Engine) -> None:
    played = await play(engine, "print('ready')\nwhile True: pass", limits=Limits(wall=0.05))
    assert isinstance(played.ending, Failed)
    assert (played.ending.reason, played.ending.line) == (ExitReason.WALL, 2)
    run = await started(engine, BUSY, Limits(wall=0.3))
    await run.suspend()
    await asyncio.sleep(0.4)
    assert run.exit_reason is None
    await run.resume()
    end = await last(run)
    assert isinstance(end, Failed)
    assert end.reason is ExitReason.WALL
    with pytest.raises(ValueError, match="below 0"):
        Limits(wall=-1)


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
        run.answered = lambda name, body: heard.append(Replied(name, body))
        calls.append(call)
        if len(heard) == limit:
            os.kill(run.pid, signal.SIGKILL)
        elif call.name.endswith("turn"):
            run.fail(call.id, "ValueError", "no")
        else:
            run.reply(call.id, call.args[0])

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


async def test_a_program_that_does_something_else_the_second_time_is_ended(engine: Engine) -> None:
    run = await engine.start(
        "cyberdog.echo(1)\ncyberdog.motion.turn(2)",
        PRELUDE,
        history=[Replied("cyberdog.echo", b'{"t":"value","value":1}'), Replied("cyberdog.echo", b"")],
    )
    events = [event async for event in run]
    assert isinstance(events[-1], Failed)
    assert events[-1].reason is ExitReason.DIVERGED
    assert not any(isinstance(event, Call) for event in events)
