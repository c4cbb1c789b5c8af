"""The server is killed while a program runs: nothing acknowledged is lost, nothing goes on running by itself."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest

from roboglot.model.robot import Robot
from roboglot.programs.tasks.task_run import TaskRun
from roboglot.storage.database import Database
from roboglot.storage.journals import DatabaseJournalStore
from roboglot.testing.process import child
from tests.protocols.visual.front_end import FrontEnd

SERVER = """
# warm
import asyncio, json, sys
from pathlib import Path
from roboglot.model.clock import RealClock
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.visual.server import VisualDoor
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores
from roboglot.storage.journals import DatabaseJournalStore

async def main():
    stores = program_stores(Database(Path(sys.argv[1])), "a")
    door = VisualDoor(service := ProgramService(Robot("a", None, RealClock()), Engine(), stores))
    await door.start()
    door.subscribe(lambda text: print(text, flush=True))
    for operate, fields in (
        ("save", {"mode": "single", "condition": "now", "body": "print('begun')\\ntime.sleep(1e5)"}),
        ("run", {}),
        ("suspend", {}),
        ("recover", {}),
    ):
        frame = {"type": "task", "id": operate, "operate": operate, "target_id": ["t"]} | fields
        await door.receive(json.dumps(frame))
    print(service._runs["t"]._run.pid, flush=True)
    await asyncio.Event().wait()

asyncio.run(main())
"""


def runs(pid: str) -> bool:
    """True until the process has ended, also where no init process reaps it."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in "ZX"


async def test_a_program_does_not_outlive_its_server(
    connect: Callable[..., Coroutine[Any, Any, FrontEnd]], plain_robot: Robot, tmp_path: Path
) -> None:
    path = tmp_path / "robot.db"
    with child(SERVER, str(path)) as server:
        assert server.stdout
        lines = iter(server.stdout.readline, "")
        worker = next(line for line in lines if line.strip().isdigit()).strip()
        server.kill()
    deadline = time.monotonic() + 60
    while runs(worker) and time.monotonic() < deadline:
        time.sleep(0.01)  # noqa: ASYNC251
    assert not runs(worker)
    with contextlib.closing(Database(path)) as database:
        app = await connect(plain_robot, database)
        assert await app.state("t") == "suspend"
        assert (await app.ask("recover", "t"))[0]["state"] == 0
        await app.until(lambda: app.service._runs["t"].line == 2)
        log = await app.service.log("t")
        assert any("recover it to go on, or shut it down" in entry.text for entry in log)
        assert log[-1].text == "begun"  # once more, which the log says
        assert "is printed again" in log[-2].text
        assert (await app.ask("shutdown", "t"))[0]["state"] == 0
        assert await app.state("t") == "shutdown"
        assert DatabaseJournalStore(database, "a").headers_now() == {}


async def test_recover_waits_until_the_task_is_restored(
    connect: Callable[..., Coroutine[Any, Any, FrontEnd]],
    plain_robot: Robot,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = tmp_path / "robot.db"
    with child(SERVER, str(path)) as server:
        assert server.stdout
        next(line for line in iter(server.stdout.readline, "") if line.strip().isdigit())
        server.kill()
    begun, may_go_on, revive = asyncio.Event(), asyncio.Event(), TaskRun.revive

    async def revive_slowly(run: TaskRun) -> None:
        begun.set()
        await may_go_on.wait()
        await revive(run)

    monkeypatch.setattr(TaskRun, "revive", revive_slowly)
    with contextlib.closing(Database(path)) as database:
        app = await connect(plain_robot, database)
        await begun.wait()
        recovering = asyncio.ensure_future(app.ask("recover", "t"))
        await asyncio.sleep(0)
        may_go_on.set()
        assert (await recovering)[0]["state"] == 0
        assert await app.state("t") == "run"
        assert (await app.ask("shutdown", "t"))[0]["state"] == 0
