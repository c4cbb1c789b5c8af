"""A server of tasks whose robot speaks into a file, for tests that kill it.

python killed_robot.py DATABASE FILE TASKS BEGIN PARENT: keeps so many tasks running, recovers those that a killed
server left behind, and prints its requests, their acknowledgements and refusals. With 0 for BEGIN it starts
nothing new and says "over" when nothing is under way any more. It ends with PARENT, also if that is killed. Each run
has a number of its own, and says it with each step.
"""

from __future__ import annotations

import asyncio
import os
import sys
from pathlib import Path
from typing import cast

from roboglot.model.actions import Action
from roboglot.model.clock import RealClock
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.robot import Description, Robot
from roboglot.programs.engine import engine as engine_module
from roboglot.programs.engine.engine import Engine
from roboglot.programs.errors import ProgramError
from roboglot.programs.stores import StoredProgram
from roboglot.programs.tasks.service import ProgramService
from roboglot.programs.tasks.states import TaskState
from roboglot.shards.warm_up import end_with
from roboglot.storage.database import Database
from roboglot.storage.programs import program_stores

SPEED = 600.0
STEPS = 8
BODY = f"""import random
me = random.randrange(10**12)
for step in range({STEPS}):
    if cyberdog.audio.instantly_play(f'{{me}} {{step}}').code == StateCode.spin_future_interrupted:
        print('interrupted', me, step)
    time.sleep(12)
"""


class Recorder(Speaker):
    """Every word goes to the file at once: it survives the kill."""

    def __init__(self, file: str) -> None:
        self._file = os.open(file, os.O_CREAT | os.O_APPEND | os.O_WRONLY)

    volume = 1.0

    async def set_volume(self, volume: float) -> None:
        raise NotImplementedError

    def say(self, text: str, *, source: str = "") -> Action:
        os.write(self._file, f"{source} {text}\n".encode())
        return cast(Action, None)

    def play(self, sound: object, *, source: str = "") -> Action:
        raise NotImplementedError


async def main(database: str, file: str, tasks: int, begin: int) -> None:
    robot = Robot("a", cast(Description, None), RealClock(SPEED))
    robot.add(Speaker, Recorder(file))
    service = ProgramService(robot, Engine(), program_stores(Database(Path(database)), robot.id))
    service.start()
    for number in range(tasks):
        if await service.get(f"t{number}") is None:
            await service.save(StoredProgram(f"t{number}", "", "", "single", "now", BODY, ""))
    refusals = set[str]()
    while True:
        under_way = 0
        for task in await service.tasks():
            under_way += task.state in (TaskState.RUN, TaskState.SUSPEND, TaskState.RUN_WAIT)
            try:
                if task.state == TaskState.SUSPEND:
                    await service.recover(task.id)
                    print("recovered", task.id, flush=True)
                elif begin and task.state not in (TaskState.RUN, TaskState.RUN_WAIT):
                    print("asked", task.id, flush=True)
                    await service.run(task.id)
                    print("begun", task.id, flush=True)
            except ProgramError as error:  # it may have ended meanwhile
                if (refusal := f"refused {task.id} {error}") not in refusals:
                    refusals.add(refusal)
                    print(refusal, flush=True)
        if not begin and not under_way:
            print("over", flush=True)
            return
        await asyncio.sleep(0.005)


if __name__ == "__main__":
    engine_module.ANSWER_MAX = 200.0  # programs have a low priority: minutes on a busy machine are seconds to them
    end_with(int(sys.argv[5]))
    asyncio.run(main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])))
