"""Limits of a run, and what happens beyond them."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass
from functools import partial
from typing import Any

import pytest

from roboglot.programs.engine import calls as calls_module
from roboglot.programs.engine import engine as engine_module
from roboglot.programs.engine import run as run_module
from roboglot.programs.engine import share as share_module
from roboglot.programs.engine.calls import Calls
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import (
    Call,
    ExitReason,
    Failed,
    Finished,
    Limits,
    Output,
)
from roboglot.programs.engine.messages import Message, OutputMessage
from roboglot.programs.engine.run import OUTPUT_COST, SHORT_COST, Run
from roboglot.programs.engine.share import BURST, LIGHT_BURST, SHARE_MAX, ThreadShare
from tests.programs.playing import BUSY, PRELUDE, last, play, process_state, started, until

pytestmark = pytest.mark.asyncio(loop_scope="module")
SPANS = 8  # of a second each


async def test_limits_name_themselves(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_module, "STEPS_BACK_AFTER", 1e6)  # a second of processor time is used up soon
    small = 32 * 1024 * 1024
    memory, cpu, output, recursion = await asyncio.gather(
        play(engine, "x = []\nwhile True:\n    x.append('a' * 10000 + str(len(x)))", limits=Limits(memory=small)),
        play(engine, "while True: pass", limits=Limits(cpu=1)),
        play(engine, "while True: print('x' * 50)", limits=Limits(output=10_000)),
        play(engine, "def f(n): return f(n + 1)\nf(0)", limits=Limits(recursion=100)),
    )
    reasons = [played.ending.reason for played in (memory, cpu, output, recursion) if isinstance(played.ending, Failed)]
    assert reasons == [ExitReason.MEMORY, ExitReason.CPU, ExitReason.OUTPUT, ExitReason.ERROR]
    assert isinstance(recursion.ending, Failed)
    assert recursion.ending.type == "RecursionError"
    assert len(output.output) <= 10_000


async def test_calls_at_depth_limit_do_not_break_off(engine: Engine) -> None:
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


async def test_calls_above_rate_are_slowed_down_not_ended(engine: Engine) -> None:
    """100 calls may come at once; the other 200 take a fifth of a second at 1000 a second."""
    loop = asyncio.get_running_loop()
    before = loop.time()
    played = await play(engine, "for i in range(300): cyberdog.echo(i)", limits=Limits(call_rate=1000))
    assert played.ending == Finished()
    assert len(played.calls) == 300
    assert loop.time() - before >= 0.19


async def test_large_arguments_are_slowed_down_too(engine: Engine) -> None:
    """Reading a megabyte of nested lists takes the server longer than sending it takes a forger."""
    loop = asyncio.get_running_loop()
    before = loop.time()
    played = await play(engine, "x = '-' * 400000\nfor i in range(4): cyberdog.echo(x)", limits=Limits(call_rate=10**6))
    assert played.ending == Finished()
    assert loop.time() - before >= 1.6 / 2.1 - 0.11  # MB, MB a second, and the burst


@pytest.mark.slow
async def test_too_many_values_are_refused_in_the_program(engine: Engine) -> None:
    source = """
try:
    cyberdog.echo([[] for i in range(110000)])
except ValueError as e:
    print(e)
x = ', [{' * 50000
assert cyberdog.echo(x) == x and cyberdog.echo([x]) == [x]
x = [[i, {'a': i}] for i in range(10000)]
assert cyberdog.echo(x) == x
"""
    played = await play(engine, source)
    assert played.ending == Finished()
    assert played.output == "more values than can be passed to the robot at once\n"


async def test_greedy_programs_get_turns_one_by_one() -> None:
    share, turns, loop = ThreadShare(), list[int](), asyncio.get_running_loop()
    accounts = [share.account() for _ in range(3)]
    for account in accounts:
        account.charge(0.01)
    began = loop.time()

    def work(number: int) -> None:
        turns.append(number)
        accounts[number].charge(0.005)
        if len(turns) < 9:
            accounts[number].go_on(lambda: work(number))

    for number in range(3):
        accounts[number].go_on(partial(work, number))
    assert turns == []
    share.account().go_on(lambda: turns.append(9))  # it has used nothing yet: no need to wait
    await until(lambda: len(turns) >= 9)
    assert turns[:7] == [9, 0, 1, 2, 0, 1, 2]
    assert loop.time() - began >= (0.03 + 7 * 0.005) / SHARE_MAX - BURST - 0.01


@dataclass
class Cost:
    """Thread time, s."""

    spent: float = 0.0
    charged: float = 0.0


class Ledger:
    """Work of the loop's thread for programs, and their charges for it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.charges: list[float] = []
        self.due = 0.0  # for the frames, whatever it takes to read those that are long
        self.first, self.more = Cost(), Cost()  # of the callbacks that read the first part of long calls, and more
        self._reading: Cost | None = None
        charge, read, run, decode = ThreadShare.charge, Calls._read, asyncio.Handle._run, run_module.decode

        def charged(share: ThreadShare, seconds: float, now: float) -> None:
            self.charges.append(seconds)
            charge(share, seconds, now)

        def reading(*arguments: Any, **named: Any) -> None:
            self._reading = self.more if named.get("in_turn") else self.first
            read(*arguments, **named)

        def measured(handle: asyncio.Handle) -> None:
            self._reading, count, began = None, len(self.charges), time.thread_time()
            run(handle)
            if self._reading is not None:
                self._reading.spent += time.thread_time() - began
                self._reading.charged += sum(self.charges[count:])

        def decoded(body: bytes) -> Message:
            message = decode(body)
            self.due += OUTPUT_COST if isinstance(message, OutputMessage) else SHORT_COST
            return message

        monkeypatch.setattr(ThreadShare, "charge", charged)
        monkeypatch.setattr(Calls, "_read", reading)
        monkeypatch.setattr(asyncio.Handle, "_run", measured)
        monkeypatch.setattr(run_module, "decode", decoded)

    def clear(self) -> None:
        self.charges.clear()
        self.due = 0.0
        self.first, self.more = Cost(), Cost()


@pytest.mark.slow  # in short: test_greedy_programs_get_turns_one_by_one
async def test_hostile_programs_together_keep_to_the_share(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    """The server's thread keeps most of its time for others, no matter what programs send.

    That each frame is charged, and the time that it takes to read a long one, holds exactly. What is spent in all is
    compared over several spans: other work on the machine makes some of them dearer.
    """
    light = SHARE_MAX / 100  # each uses more than that, however little a busy machine gives
    monkeypatch.setattr(share_module, "LIGHT", light)
    ledger = Ledger(monkeypatch)
    sources = (
        "x = [[] for i in range(20000)]\nwhile True: cyberdog.echo(x)",
        "while True: print('x' * 100)",
        "while True: cyberdog.echo(1)",
    )
    runs = [await engine.start(source, PRELUDE, Limits(output=10**9)) for source in sources for _ in range(4)]

    async def serve(run: Run, *, at_once: bool) -> None:
        if at_once:
            run.calls.asked = lambda call: run.calls.reply(call.id)
        async for event in run:
            if isinstance(event, Call):
                run.calls.reply(event.id)

    serving = [asyncio.create_task(serve(run, at_once=number % 2 > 0)) for number, run in enumerate(runs)]
    await asyncio.sleep(1.0)  # the burst of each
    loop, excess = asyncio.get_running_loop(), list[float]()
    while len(excess) < SPANS and min(excess, default=1.0) >= 0.0:
        await until(lambda: ledger.first.spent > 0.0)
        ledger.clear()
        before, spent = loop.time(), time.thread_time()
        await asyncio.sleep(1.0)
        passed, spent = loop.time() - before, time.thread_time() - spent
        if not ledger.charges:  # the machine gave the programs no turn
            continue
        charged, longest = sum(ledger.charges), max(ledger.charges)
        free = len(runs) * (light * (passed + LIGHT_BURST) + longest)  # without a turn, and beyond a turn's end
        assert charged <= SHARE_MAX * (passed + BURST) + free
        assert charged >= ledger.due
        assert ledger.first.spent <= 1.7 * ledger.first.charged
        assert ledger.more.spent <= 1.7 * ledger.more.charged
        excess.append(spent - 1.7 * charged - 0.05 * passed)
    await asyncio.gather(*(run.kill() for run in runs))
    await asyncio.gather(*serving)
    assert min(excess) < 0.0


async def test_a_long_call_is_read_in_turns(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    reads = []
    read = Calls._read
    monkeypatch.setattr(Calls, "_read", lambda *args, **named: reads.append(read(*args, **named)))
    monkeypatch.setattr(calls_module, "STEP", 0.0001)
    run = await engine.start("cyberdog.echo([[i] for i in range(24000)])", PRELUDE)
    event = await anext(run)
    assert isinstance(event, Call)
    assert event.args == ([[i] for i in range(24000)],)
    assert len(reads) > 10
    await run.kill()


async def test_short_calls_are_held_by_their_rate_alone(engine: Engine) -> None:
    """They once had to wait for twenty times the time that it took to read them."""
    assert 1 / Limits().call_rate > SHORT_COST / SHARE_MAX
    played = await play(engine, "for i in range(50): cyberdog.echo(i)", limits=Limits(call_rate=100_000))
    assert played.ending == Finished()


async def test_thousands_of_outputs_arrive_whole_and_joined(engine: Engine) -> None:
    run = await engine.start("for i in range(5000): print(i)", PRELUDE)
    texts = [event.text async for event in run if isinstance(event, Output)]
    assert "".join(texts) == "".join(f"{i}\n" for i in range(5000))
    assert len(texts) < 2500


@pytest.mark.slow
async def test_a_slow_reader_makes_the_program_wait(engine: Engine) -> None:
    """Nothing piles up in the server: the socket fills and the program blocks in print."""
    run = await engine.start(
        "for i in range(400): print(str(i) * 20000)\ncyberdog.echo()", PRELUDE, Limits(output=10**9)
    )
    await until(lambda: process_state(run.pid) == "S" and run.position.line == 1)
    size = 0
    async for event in run:
        match event:
            case Output(text=text):
                size += len(text)
            case Call():
                run.calls.reply(event.id)
    assert size == sum(len(str(i)) * 20000 + 1 for i in range(400))
    assert run.exit_reason is ExitReason.FINISHED


@pytest.mark.slow  # real time
async def test_time_limit_of_a_run_pauses_during_suspension(engine: Engine) -> None:
    run = await started(engine, BUSY, Limits(wall=60.0))  # a busy machine may take a while
    await run.suspend()
    run._clock._left = 0.05
    await asyncio.sleep(0.1)
    assert run.exit_reason is None
    await run.resume()
    end = await last(run)
    assert isinstance(end, Failed)
    assert end.reason is ExitReason.WALL
    assert 2 <= end.line <= 5
    with pytest.raises(ValueError, match="below 0"):
        Limits(wall=-1)
