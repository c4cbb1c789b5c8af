"""All programs together have a budget of memory: the largest goes first."""

from __future__ import annotations

import asyncio

import pytest

from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import (
    ExitReason,
    Failed,
    Limits,
    Output,
)
from roboglot.programs.engine.memory_budget import MemoryBudget
from tests.programs.playing import PRELUDE, until

pytestmark = pytest.mark.asyncio(loop_scope="module")

MEGABYTE = 1024**2


class Spending:
    def __init__(self, pid: int) -> None:
        self.pid = pid
        self.ended = ""

    def end(self, reason: ExitReason, _kind: str, message: str) -> None:
        assert reason is ExitReason.MEMORY
        self.ended = message


async def test_the_largest_are_ended_until_the_rest_fits() -> None:
    sizes = {1: 30, 2: 50, 3: 20, 4: 40}
    runs = {pid: Spending(pid) for pid in sizes}
    living = set(runs.values())
    budget = MemoryBudget(living, 60 * MEGABYTE, lambda pid: (sizes[pid] + 5) * MEGABYTE)
    budget.empty = 5 * MEGABYTE
    budget.watch()
    await until(lambda: any(run.ended for run in living))
    assert [pid for pid, run in runs.items() if run.ended] == [2, 4]
    assert "60 MiB" in runs[2].ended
    await budget.close()


async def test_programs_together_stay_within_the_budget() -> None:
    body = "x = bytearray(30_000_000)\nfor i in range(0, len(x), 4096): x[i] = 1\nprint('ready')\nwhile True: pass"
    async with Engine(memory_together=80 * MEGABYTE) as engine:
        runs = [await engine.start(body, PRELUDE, Limits()) for _ in range(3)]

        async def last(number: int) -> Failed:
            async for event in runs[number]:
                if isinstance(event, Failed):
                    return event
                assert isinstance(event, Output)
            raise AssertionError("no end")

        ends = [asyncio.ensure_future(last(number)) for number in range(3)]
        done, going_on = await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED, timeout=60)
        assert {end.result().reason for end in done} == {ExitReason.MEMORY}
        assert len(going_on) == 2
        await asyncio.gather(*(run.kill() for run in runs))
        await asyncio.gather(*ends)
