"""Time of a list of ten thousand stored tasks, from the frame to its answer."""

from __future__ import annotations

import asyncio
import json
import tempfile
import time
from pathlib import Path
from typing import cast

from _claim import Claims

from roboglot.model.clock import RealClock
from roboglot.model.robot import Description, Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.stores import StoredProgram
from roboglot.programs.tasks.service import TASKS_MAX, ProgramService
from roboglot.protocols.visual.server import VisualDoor
from roboglot.storage.database import Database
from roboglot.storage.programs import DatabaseProgramStore, program_stores

BODY = "cyberdog.motion.turn(90)\n" * 40
STYLE = json.dumps({"blocks": {"languageVersion": 0, "blocks": [{"type": "turn", "fields": {"angle": 90}}] * 10}})


async def main() -> None:
    """Fill a database, ask five times."""
    claims = Claims()
    with tempfile.TemporaryDirectory() as folder:
        database, engine = Database(Path(folder) / "roboglot.db"), Engine()
        store = DatabaseProgramStore(database, "a")
        for number in range(TASKS_MAX):
            task = StoredProgram(f"t{number}", "a task", STYLE, "single", "now", BODY, "wait_run")
            await store.put(task, [f"m{number % 50}"])
        robot = Robot("a", cast(Description, None), RealClock())
        door = VisualDoor(ProgramService(robot, engine, program_stores(database, robot.id)))
        answers: list[str] = []
        door.subscribe(answers.append)
        frame = json.dumps({"type": "task", "id": "f", "operate": "inquiry", "target_id": []})
        wall, cpu = [], []
        for _ in range(5):
            began, used = time.perf_counter(), time.process_time()
            await door.receive(frame)
            wall.append(time.perf_counter() - began)
            cpu.append(time.process_time() - used)
        assert len(json.loads(answers[-1])["response"]["list"]) == TASKS_MAX
        await door.close()
        await engine.close()
        database.close()
    claims.at_most("list of 10,000 tasks", min(wall), 0.2, "s")
    print(f"processor time {min(cpu):.3f} s, {len(answers[-1]) / 1e6:.1f} MB of answer")
    claims.finish()


asyncio.run(main())
