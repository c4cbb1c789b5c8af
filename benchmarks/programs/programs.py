"""Claims about running people's programs: start, host call, loops with line marks, suspend and kill.

Wall-clock times on an otherwise idle machine; loops are processor time inside the worker, against CPython without
anything. ``programs_crowd.py`` has the claims about many programs at once.
"""

from __future__ import annotations

import asyncio
import statistics
import subprocess
import sys
import time

import uvloop
from _claim import Claims
from _ping_pong import floor

from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import (
    Call,
    Failed,
    Limits,
    Output,
)
from roboglot.programs.engine.run import Run
from roboglot.programs.engine.share import BURST
from roboglot.programs.functions.prelude import ability_set

REPEATS = 100
CALL_RUNS, CALLS = 20, 900
FREE_CALLS = 18  # few enough that the server's share does not throttle them
FAST = Limits(call_rate=10**9)
PRELUDE = ability_set()
PROGRAM = """cyberdog.task.block('b1');
def patrol(times):
    for i in range(times):
        if i % 2 == 0:
            cyberdog.motion.turn(90, 2);
        else:
            cyberdog.motion.go_straight(0.3, 0.5);
print('ready')
while true:
    pass
"""
LOOPS = {
    "while": "n = 0\nwhile n < 2000000:\n    n += 1\n",
    "for": "t = 0\nfor i in range(2000000):\n    t += i\n",
    "fib": "def fib(n):\n    if n < 2:\n        return n\n    return fib(n - 1) + fib(n - 2)\nfib(25)\n",
    "lists": "xs = []\nfor i in range(500000):\n    xs.append(i * 2)\n    if i % 3 == 0:\n        xs[i // 2] = i\n",
    "dicts": "d = {}\nfor i in range(500000):\n    k = i % 100\n    d[k] = d.get(k, 0) + 1\n",
    "floats": "x = 0.0\nfor i in range(800000):\n    x = x * 0.5 + i\n    y = x / 3.0\n",
    "text": "s = ''\nfor i in range(300000):\n    s = s[-50:] + str(i)\n    if 'x' in s:\n        break\n",
}
LOOP_REPEATS = 5


async def first_output(run: Run) -> None:
    async for event in run:
        match event:
            case Output():
                return
            case Call():
                run.calls.reply(event.id, None)
            case Failed():
                raise RuntimeError(event.message)


async def start_and_kill(engine: Engine, claims: Claims) -> None:
    starts, kills, stops = [], [], []
    for _ in range(REPEATS):
        began = time.perf_counter()
        run = await engine.start(PROGRAM, PRELUDE)
        await first_output(run)
        starts.append(time.perf_counter() - began)
        began = time.perf_counter()
        await run.suspend()
        stops.append(time.perf_counter() - began)
        await run.resume()
        began = time.perf_counter()
        await run.kill()
        kills.append(time.perf_counter() - began)
    claims.at_most("run start to first output, warm", statistics.median(starts) * 1000, 10, "ms")
    claims.at_most("suspend in while True", statistics.median(stops) * 1000, 5, "ms")
    claims.at_most("kill in while True", statistics.median(kills) * 1000, 10, "ms")


async def host_calls(engine: Engine, claims: Claims) -> None:
    """Time calls in sequence: a few, and so many that the share of the server's thread throttles them.

    By the wall, the best stretch: two processes hand over to each other four times a call, and the machine's other
    load comes in between. With many calls the program mostly waits: all programs together have a
    fifth of the thread.
    """
    source = f"for i in range({CALLS}):\n    cyberdog.motion.turn(i, 2)\n"
    stretches, spent = [], 0.0
    for _ in range(CALL_RUNS):
        run = await engine.start(source, PRELUDE, FAST)
        count, began, host, worker = 0, 0.0, 0.0, 0.0
        async for event in run:
            if isinstance(event, Call):
                if count == 0:
                    began, host, worker = time.perf_counter(), time.thread_time(), processor_seconds(run.pid)
                count += 1
                if count == CALLS:
                    stretches.append((time.perf_counter() - began) / (CALLS - 1))
                    spent += time.thread_time() - host + processor_seconds(run.pid) - worker
                run.calls.reply(event.id, None)
    free = await free_calls(engine)
    bare, bare_spent = await floor()
    print(f"(two processes that only read and write: {bare * 1e6:.2f} us, processor time {bare_spent * 1e6:.2f} us)")
    claims.at_most("host call that nothing holds", free / bare, 1.5, "x two bare processes")
    claims.at_most("host call, of many", min(stretches) * 1e6, 60, "us")
    claims.at_most("host call, processor time of both", spent / CALL_RUNS / (CALLS - 1) * 1e6, 60, "us")


async def free_calls(engine: Engine) -> float:
    """Seconds of a call by the wall, the best stretch, before the program has used up what it may take at once.

    Answered when it comes, as a task's calls are that need not wait.
    """
    source = f"for i in range({FREE_CALLS}):\n    cyberdog.motion.turn(i, 2)\n"
    stretches = []
    for _ in range(2 * CALL_RUNS):
        run, came = await engine.start(source, PRELUDE, FAST), list[float]()

        def answer(call: Call, run: Run = run, came: list[float] = came) -> None:
            came.append(time.perf_counter())
            run.calls.reply(call.id, None)

        run.calls.asked = answer
        async for event in run:
            if isinstance(event, Call):
                answer(event)
        stretches.append((came[-1] - came[2]) / (FREE_CALLS - 3))
        await asyncio.sleep(BURST)  # all programs share one burst allowance
    return min(stretches)


async def loops(engine: Engine, claims: Claims) -> None:
    """Plain: the same interpreter running the same text; both by processor time, best of some, taken in turns."""
    for name, source in LOOPS.items():
        plain, ours = [], []
        for _ in range(LOOP_REPEATS):
            plain.append(await asyncio.to_thread(plain_seconds, source))
            ours.append(await own_seconds(engine, source))
        claims.at_least(f"loop '{name}' against CPython", min(plain) / min(ours), 0.6, "x")


def plain_seconds(source: str) -> float:
    code = f"import time\nc = compile({source!r}, 'p', 'exec')\nt = time.process_time()\nexec(c, {{}})\n"
    done = subprocess.run(
        [sys.executable, "-I", "-c", code + "print(time.process_time() - t)"],
        capture_output=True,
        text=True,
        check=True,
    )
    return float(done.stdout)


async def own_seconds(engine: Engine, source: str) -> float:
    """Processor time of the worker from its first call to its second."""
    run = await engine.start(f"cyberdog.task.block('a')\n{source}cyberdog.task.block('b')\n", PRELUDE)
    seconds = []
    async for event in run:
        if isinstance(event, Call):
            seconds.append(processor_seconds(run.pid))
            run.calls.reply(event.id, None)
    return seconds[1] - seconds[0]


def processor_seconds(pid: int) -> float:
    with open(f"/proc/{pid}/schedstat") as file:
        return int(file.read().split()[0]) / 1e9


async def run_all() -> None:
    claims = Claims()
    async with Engine() as engine:
        await first_output(run := await engine.start("print(1)", PRELUDE))
        await run.wait()
        await start_and_kill(engine, claims)
        await host_calls(engine, claims)
        await loops(engine, claims)
    claims.finish()


if __name__ == "__main__":
    uvloop.run(run_all())
