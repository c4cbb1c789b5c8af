"""Claim: with 300 programs at once, all waiting in motions or all busy, the server's loop answers within 20 ms (p99).

A timer on the loop asks every 5 ms how late it is, for 10 seconds. All figures are wall-clock time, on two cores or
more, with nothing else running.
"""

from __future__ import annotations

import asyncio
import contextlib
import time

import uvloop
from _claim import Claims

from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import (
    Call,
    Failed,
    Finished,
    Output,
)
from roboglot.programs.engine.run import Run
from roboglot.programs.functions.prelude import ability_set

PROGRAMS, SECONDS, TICK, MOTION = 300, 10.0, 0.005, 0.2
PRELUDE = ability_set()
WAITING = "while true:\n    cyberdog.motion.turn(10, 2)\n"
BUSY = "print('ready')\nn = 0\nwhile true:\n    n += 1\n"


async def serve(run: Run, ready: asyncio.Event) -> None:
    """Answer each call after the time a motion takes."""
    loop = asyncio.get_running_loop()
    async for event in run:
        match event:
            case Call():
                ready.set()
                loop.call_later(MOTION, answer, run, event.id)
            case Output():
                ready.set()
            case Finished() | Failed():
                ready.set()


def answer(run: Run, id: int) -> None:
    with contextlib.suppress(LookupError):  # killed meanwhile
        run.calls.reply(id, None)


async def lateness() -> list[float]:
    """Record the loop's delay at each turn."""
    late = []
    end = time.perf_counter() + SECONDS
    while (now := time.perf_counter()) < end:
        await asyncio.sleep(TICK)
        late.append(time.perf_counter() - now - TICK)
    return late


async def crowd(engine: Engine, source: str, name: str, claims: Claims) -> None:
    began = time.perf_counter()
    runs, tasks = [], []
    for _ in range(PROGRAMS):
        ready = asyncio.Event()
        run = await engine.start(source, PRELUDE)
        runs.append(run)
        tasks.append(asyncio.create_task(serve(run, ready)))
        await ready.wait()
        await run.suspend()  # leaves time for the others to start
    await asyncio.gather(*(run.resume() for run in runs))
    print(f"{PROGRAMS} programs {name}: all under way after {time.perf_counter() - began:.1f} s", flush=True)
    late = sorted(await lateness())
    claims.at_most(f"loop p99, {PROGRAMS} {name}", late[int(len(late) * 0.99)] * 1000, 20, "ms")
    await asyncio.gather(*(run.kill() for run in runs))
    await asyncio.gather(*tasks)


async def run_all() -> None:
    claims = Claims()
    async with Engine() as engine:
        print(f"walls: {', '.join(engine.layers)}")
        await crowd(engine, WAITING, "waiting in motions", claims)
        await crowd(engine, BUSY, "busy", claims)
    claims.finish()


if __name__ == "__main__":
    uvloop.run(run_all())
