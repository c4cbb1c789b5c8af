"""Frames that come all at once, in any order, for programs that end at any moment."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import pytest

from roboglot.programs.stores import LogEntry
from tests.protocols.visual.front_end import PATIENCE, FrontEnd

BODIES = (
    "while True:\n    pass\n",
    "for n in range(5):\n    cyberdog.task.block(str(n))\n    time.sleep(0.01)\n",
    "cyberdog.task.breakpoint_block('b')\ntime.sleep(0.1)\n",
    "cyberdog.task.block('x')\n1 / 0\n",
    "cyberdog.task.block('x')\ncyberdog.task.stop()\n",
)
IDS = ("t", "t1", "t10", "t2")


@pytest.mark.slow  # in short: test_random_operations_end_at_rest
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
async def test_states_agree_after_random_operations(app: FrontEnd, seed: int) -> None:
    dice = random.Random(seed)
    pids: set[int] = set()

    async def user() -> None:
        for _ in range(60):
            operation = dice.choice(
                ["save", "run", "run", "suspend", "recover", "shutdown", "delete", "inquiry", "debug"]
            )
            id = "debug" if operation == "debug" else dice.choice(IDS)
            fields = {"mode": "single", "condition": "now", "body": dice.choice(BODIES)}
            answers = await app.ask(operation, id, **(fields if operation in ("save", "debug") else {}))
            assert all(answer.get("state") in (None, 0, 27) for answer in answers), answers
            pids.update(run._run.pid for run in app.service._runs.values())

    async def time_passes() -> None:
        while True:
            await asyncio.sleep(0.002)
            await app.clock.advance(0.01)

    passing = asyncio.create_task(time_passes())
    await asyncio.gather(*(user() for _ in range(4)))
    for id in (*IDS, "debug"):
        await app.ask("shutdown", id)
    passing.cancel()
    assert app.service._runs == {}
    stored = {task.id: task.state for task in await app.service._store.all()}
    assert not {"run", "suspend", "run_wait"} & set(stored.values()), stored
    assert not [pid for pid in pids if Path(f"/proc/{pid}").exists()]  # noqa: ASYNC240
    for id in (*IDS, "debug"):
        marks = app.blocks(id)
        assert len(marks) % 2 == 0
        assert all(one[0] != other[0] for one, other in pairwise(marks))
        assert all(begin[1] == end[1] for begin, end in zip(marks[::2], marks[1::2], strict=True))


@pytest.mark.slow  # a load test; in short: tests/programs/engine/test_engine.py
async def test_each_of_twenty_busy_programs_is_stopped_individually(app: FrontEnd) -> None:
    ids = [f"t{number}" for number in range(20)]
    for id in ids:
        await app.start(id, BODIES[0])
    answers = await app.ask("suspend", *ids)
    assert [answer["state"] for answer in answers] == [0]
    assert all(app.news(id, "suspend") for id in ids)
    await app.ask("shutdown", *ids)
    assert all(app.news(id, "shutdown") for id in ids)
    assert app.service._runs == {}


async def test_programs_end_together_when_the_server_closes(app: FrontEnd, monkeypatch: pytest.MonkeyPatch) -> None:
    for number in range(6):
        await app.start(f"t{number}", "while True:\n    time.sleep(1)\n")
    pids = [run._run.pid for run in app.service._runs.values()]
    store, waiting = app.service._store, 0
    write = store.set_state

    async def slowly(id: str, state: str, log: Sequence[LogEntry] = ()) -> None:
        nonlocal waiting
        waiting += 1
        async with asyncio.timeout(PATIENCE):  # a slow disk: neither programs nor other writes wait for it
            while waiting < len(pids) or any(Path(f"/proc/{pid}").exists() for pid in pids):  # noqa: ASYNC110, ASYNC240
                await asyncio.sleep(0.001)
        await write(id, state, log)

    monkeypatch.setattr(store, "set_state", slowly)
    await app.service.close()
    assert {task.state for task in await store.all()} == {"shutdown"}
