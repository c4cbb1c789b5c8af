"""Random walks over programs: saved, run, suspended, recovered, shut down and deleted at any moment, two at a time."""

from __future__ import annotations

import asyncio
import math
import random
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.programs.tasks.states import DEBUG, TaskState
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.protocols.visual.front_end import FrontEnd, alive
from tests.protocols.witness import Witness, walks

ROUNDS = 25
LOOKS = [1, 2, 5, 10, 30]  # tenths of a second between two operations
HELD = 4.0  # s after which a suspended robot stands: it lands from a jump, and a dance ends its step
IDS = ["t", "u"]
OPERATIONS = ["save", "run", "run", "suspend", "suspend", "recover", "recover", "shutdown", "delete", DEBUG, "inquiry"]
CALLS = """
import random
random.seed({seed})
def some(n):
    if n == 0: cyberdog.motion.turn(random.uniform(-180, 180), random.uniform(0, 2))
    elif n == 1: cyberdog.motion.go_straight(random.uniform(-0.5, 0.5), random.uniform(0, 1))
    elif n == 2: cyberdog.motion.go_straight(random.uniform(-0.5, 0.5), 0, random.uniform(0, 2))
    elif n == 3: cyberdog.motion.lateral_movement(random.uniform(-0.2, 0.2), random.uniform(0, 0.5))
    elif n == 4: cyberdog.motion.trot_walking(random.uniform(-0.3, 0.3), 0, random.uniform(-60, 60), distance=0.5)
    elif n == 5: cyberdog.motion.go_straight(0.4, 0, 0)
    elif n == 6: cyberdog.motion.resume_standing()
    elif n == 7: cyberdog.motion.get_down()
    elif n == 8: cyberdog.motion.sit_down()
    elif n == 9: cyberdog.motion.bow()
    elif n == 10: time.sleep(random.uniform(0, 1))
    elif n == 11: cyberdog.task.block(str(random.random()))
    elif n == 12: cyberdog.motion.shake_ass_left()
    elif n == 13: cyberdog.motion.run_fast_walking(0.5, 0, 0, duration=1)
    elif n == 14: print(cyberdog.motion.state.code, time.monotonic())
"""
BODIES = [
    "while True:\n    some(random.randrange(15))\n",
    "def deep(n):\n    some(random.randrange(15))\n    if n: deep(n - 1)\ndeep(8)\n",
    "while True:\n    some(5)\n    time.sleep(0.05)\n",
    "while True:\n    some(1)\n",
    "some(1)\nraise ValueError('gives up')\n",
]
Connect = Callable[..., Coroutine[Any, Any, FrontEnd]]


class Walk:
    """A front end that operates programs, and looks whether the robot does what their states say."""

    def __init__(self, draw: random.Random, app: FrontEnd, witness: Witness) -> None:
        self._draw, self._app, self._witness = draw, app, witness
        self.pids: set[int] = set()

    async def step(self) -> None:
        """One operation on one program."""
        draw = self._draw
        operation = draw.choice(OPERATIONS)
        id = DEBUG if operation == DEBUG else draw.choice(IDS)
        fields = {}
        if operation in ("save", DEBUG):
            body = CALLS.replace("{seed}", str(draw.random())) + draw.choice(BODIES)
            fields = {"mode": "single", "condition": "now", "body": body}
        answers = await self._app.ask(operation, id, **fields)
        self._witness.note(operation, id, [answer.get("state") for answer in answers])
        assert answers, f"{operation} is not answered"
        assert all(answer.get("operate", operation) == operation for answer in answers)

    async def pass_time(self, tenths: int) -> None:
        for _ in range(tenths):
            self.look()
            await self._witness.pass_time(0.1)

    def look(self) -> None:
        """Note whether all programs are suspended: the robot has to stand then, whatever actions it has."""
        runs = self._app.service.running()
        moving = {run.state for run in runs} - {TaskState.SUSPEND}
        since = math.inf if moving else min(self._witness.stopped_at, self._witness.now + HELD)
        self._witness.stopped_at = since
        if not runs and self._witness.now > since:
            assert not self._witness.running
        self.pids |= {run._run.pid for run in self._app.service._runs.values()}

    async def check(self) -> None:
        """Assert that the states that the door reports are those of the programs."""
        for id in IDS:
            said = await self._app.state(id)
            runs = {run.target_id: run.state for run in self._app.service.running()}
            assert TaskState(said).alive == (id in runs and runs[id].alive), (id, said, runs)


@pytest.mark.parametrize(("seed", "rounds"), walks(ROUNDS, 40))
@pytest.mark.world("empty", body="cyberdog2")
async def test_random_operations_end_at_rest(
    seed: int, rounds: int, robot: Robot, world: World, forward: Forward, connect: Connect
) -> None:
    """A suspended program's robot stands; when all are shut down, no process and no action is left."""
    draw = random.Random(seed)
    app = await connect(robot)
    world.stage.place("a", Pose(5.0, 5.0))
    witness = Witness(world, robot, forward)
    walk = Walk(draw, app, witness)
    with witness.writing():
        for _ in range(rounds):
            await walk.step()
            await walk.pass_time(draw.choice(LOOKS))
            await walk.check()
        await app.ask("shutdown", *IDS, DEBUG)
        assert not app.service.running()
        await witness.sees_it_rest(HELD)
        for _ in range(100):
            if not any(map(alive, walk.pids)):
                break
            await asyncio.sleep(0.02)
        assert not any(map(alive, walk.pids))
