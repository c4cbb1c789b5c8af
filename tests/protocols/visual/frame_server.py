"""A server of frames for tests that kill it: one frame a line on standard input, one a line on standard output.

python frame_server.py DATABASE SPEED
"""

from __future__ import annotations

import asyncio
import os
import sys
from pathlib import Path
from typing import cast

from roboglot.model.clock import RealClock
from roboglot.model.robot import Description, Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.tasks.service import ProgramService
from roboglot.protocols.visual.server import VisualDoor
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores


async def main() -> None:
    robot = Robot("a", cast(Description, None), RealClock(float(sys.argv[2])))
    door = VisualDoor(ProgramService(robot, Engine(), program_stores(Database(Path(sys.argv[1])), "a")))
    door.subscribe(lambda text: print(text, flush=True))
    await door.start()
    reader = asyncio.StreamReader(limit=1 << 23)
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), os.fdopen(0))
    pending: set[asyncio.Task[None]] = set()
    async for line in reader:
        task = asyncio.create_task(door.receive(line.decode()))
        pending.add(task)
        task.add_done_callback(pending.discard)


asyncio.run(main())
