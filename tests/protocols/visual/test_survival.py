"""Tasks after the end of clients, workers or the server."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from roboglot.model.robot import Robot
from roboglot.programs.stores import LogEntry, StoredProgram
from roboglot.storage.database import Database
from roboglot.storage.programs import DatabaseProgramStore
from tests.protocols.visual.front_end import FrontEnd, alive

Connect = Callable[..., Coroutine[Any, Any, FrontEnd]]
BUSY = "while True:\n    pass\n"
FOREVER = "time.sleep(100000)\n"


async def test_lost_client_does_not_leave_half_an_operation(app: FrontEnd) -> None:
    await app.save("t", FOREVER)
    frame = json.dumps({"type": "task", "id": "x", "operate": "run", "target_id": ["t"]})
    request = asyncio.create_task(app.door.receive(frame))
    await asyncio.sleep(0)
    request.cancel()
    await app.until(lambda: app.news("t", "start"))
    assert await app.state("t") == "run"


async def test_the_state_is_stored_before_it_is_reported(connect: Connect, plain_robot: Robot, tmp_path: Path) -> None:
    database = Database(tmp_path / "robot.db")
    app = await connect(plain_robot, database)
    reported: list[tuple[str, str]] = []
    reader = Database(tmp_path / "robot.db")

    def note(text: str) -> None:
        feedback = json.loads(text)["feedback"]
        found = reader.run_now(lambda c: c.execute("SELECT state FROM program WHERE id='t'").fetchone())
        reported.append((feedback["operate"], found[0] if found else "null"))

    app.door.subscribe(note)
    await app.start("t", FOREVER)
    for operation in ("suspend", "recover", "shutdown", "delete"):
        await app.ask(operation, "t")
    reader.close()
    assert reported == [
        ("save", "wait_run"),
        ("run", "run_wait"),
        ("start", "run"),
        ("suspend", "run"),
        ("suspend", "suspend"),
        ("recover", "suspend"),
        ("recover", "run"),
        ("shutdown", "run"),
        ("shutdown", "shutdown"),
        ("delete", "null"),
    ]
    await app.service.close()
    database.close()


async def test_run_ended_by_server_crash_is_noted(connect: Connect, plain_robot: Robot) -> None:
    database = Database(":memory:")
    store = DatabaseProgramStore(database, plain_robot.id)
    for id, mode, state in (("t1", "single", "run"), ("t2", "cycle", "suspend"), ("t3", "single", "wait_run")):
        await store.put(StoredProgram(id, "", "", mode, "now", "pass", state))
    await store.append_log("t1", [LogEntry(0.0, "print", "before")])
    app = await connect(plain_robot, database)
    assert [await app.state(id) for id in ("t1", "t2", "t3")] == ["shutdown", "run_wait", "wait_run"]
    assert [entry.level for entry in await app.service.log("t1")] == ["print", "error"]
    assert (await app.ask("run", "t1"))[0]["state"] == 0
    await app.ends("t1")
    database.close()


async def test_closing_the_server_ends_the_programs(app: FrontEnd) -> None:
    await app.start("t", BUSY)
    pid = app.service._runs["t"]._run.pid
    await app.service.close()
    assert not alive(pid)
    assert await app.state("t") == "shutdown"
    assert (await app.service.log("t"))[
        -1
    ].text == "the server shut down while the task was under way; the task was ended"


async def test_closing_the_server_ends_suspended_programs(app: FrontEnd) -> None:
    await app.start("t", FOREVER)
    await app.ask("suspend", "t")
    await app.service.close()
    assert (await app.service.log("t"))[
        -1
    ].text == "the server shut down while the task was suspended; the task was ended"


async def test_a_killed_worker_is_reported_not_left_running(app: FrontEnd) -> None:
    await app.start("t", FOREVER)
    os.kill(app.service._runs["t"]._run.pid, 9)
    await app.ends("t", pace=0.0)
    assert app.news("t", "run")[-1]["feedback"]["state"] == 26
    assert await app.state("t") == "shutdown"
