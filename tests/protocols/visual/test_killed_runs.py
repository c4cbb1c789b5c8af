"""The server is killed again and again while tasks run: each goes on where it was, no call is made twice or left out.

A few kills here; ROBOGLOT_KILLS=200 for as many as the claim says.
"""

from __future__ import annotations

import asyncio
import os
import random
import sys
from collections import Counter, defaultdict
from pathlib import Path

import pytest

from roboglot.model.clock import RealClock
from roboglot.model.robot import Description, Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.tasks.service import ProgramService
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores
from tests.protocols.visual.killed_robot import STEPS

TEXTS = dict.fromkeys(("maker", "model", "serial", "hardware_version", "software_version"), "")
UNKNOWN = Description(**TEXTS, radius=0.2, height=0.3)

KILLS = int(os.environ.get("ROBOGLOT_KILLS", "2"))
TASKS = 3
ROOT = Path(__file__).parents[3]
KILLED_ROBOT = (sys.executable, "-m", "tests.protocols.visual.killed_robot")
PATIENCE = 120.0  # s of the machine's time for a life: programs have a low priority, and three took 37 s at a load of 5


async def life(database: Path, words: Path, seconds: float | None) -> Counter[tuple[str, ...]]:
    """Return the reports of one life of the server, killed after ``seconds`` of its work; None: it ends its work."""
    arguments = [str(database), str(words), str(TASKS), "0" if seconds is None else "1", str(os.getpid())]
    pipe = asyncio.subprocess.PIPE
    server = await asyncio.create_subprocess_exec(*KILLED_ROBOT, *arguments, stdout=pipe, cwd=ROOT)
    assert server.stdout
    reported: list[bytes] = []
    try:
        async with asyncio.timeout(PATIENCE):
            if seconds is not None:
                reported.append(await server.stdout.readline())
                await asyncio.sleep(seconds)
                server.kill()
            while line := await server.stdout.readline():
                reported.append(line)
    except TimeoutError:
        raise AssertionError(f"not over within {PATIENCE:g} s, after {reported[-10:]}") from None
    await server.wait()
    return Counter(tuple(line.decode().split()) for line in reported)


async def log(database: Path) -> list[str]:
    opened = Database(database)
    service = ProgramService(Robot("a", UNKNOWN, RealClock()), Engine(), program_stores(opened, "a"))
    entries = [entry.text for number in range(TASKS) for entry in await service.log(f"t{number}")]
    assert service._journals.headers_now() == {}
    opened.close()
    return entries


@pytest.mark.timeout(190 * KILLS)  # more than the PATIENCE of each life together
async def test_runs_survive_kills(tmp_path: Path) -> None:
    chance, database, words = random.Random(5), tmp_path / "robot.db", tmp_path / "words"
    reported: Counter[tuple[str, ...]] = Counter()
    for _ in range(KILLS):
        reported += await life(database, words, chance.choice([0.0, chance.uniform(0, 0.05), chance.uniform(0, 0.5)]))
    last = await life(database, words, None)
    assert last["over",] == 1
    reported += last
    interrupted = {tuple(text.split()[1:]) for text in await log(database) if text.startswith("interrupted")}
    runs: dict[str, list[int]] = defaultdict(list)
    of: dict[str, str] = {}
    for line in words.read_text().splitlines():
        source, run, step = line.split()
        runs[run].append(int(step))
        of[run] = source.removeprefix("visual:")
    for run, steps in runs.items():
        assert steps == sorted(set(steps)), run
        missing = set(range(STEPS)) - set(steps)
        assert {(run, str(step)) for step in missing} <= interrupted, run
    for number in range(TASKS):
        id = f"t{number}"
        assert reported["begun", id] <= list(of.values()).count(id) <= reported["asked", id]
    recovered = sum(count for words, count in reported.items() if words[0] == "recovered")
    print(f"{KILLS} kills, {len(runs)} runs, {recovered} recoveries, {len(interrupted)} calls interrupted")


async def test_no_robot_outlives_a_killed_test(tmp_path: Path) -> None:
    """Start it from a parent that is killed, as pytest might be."""
    start = (
        "import os, subprocess, sys\n"
        "robot = subprocess.Popen([*sys.argv[1:], str(os.getpid())], stdout=subprocess.PIPE)\n"
        "print(robot.stdout.readline().decode().split()[0], robot.pid, flush=True)\n"
        "robot.wait()\n"
    )
    arguments = [str(tmp_path / "robot.db"), str(tmp_path / "words"), "1", "1"]
    parent = await asyncio.create_subprocess_exec(
        sys.executable, "-c", start, *KILLED_ROBOT, *arguments, stdout=asyncio.subprocess.PIPE, cwd=ROOT
    )
    assert parent.stdout
    said, number = (await asyncio.wait_for(parent.stdout.readline(), PATIENCE)).decode().split()
    assert said == "asked"
    robot = os.pidfd_open(int(number))
    gone = asyncio.Event()
    asyncio.get_running_loop().add_reader(robot, gone.set)
    parent.kill()
    try:
        await asyncio.wait_for(gone.wait(), PATIENCE)
    finally:
        asyncio.get_running_loop().remove_reader(robot)
        os.close(robot)
        await parent.wait()
