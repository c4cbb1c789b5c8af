"""Random walks of four clients, one of each vendor, on one robot at the same time; in the end all doors agree."""

from __future__ import annotations

import asyncio
import json
import random
from pathlib import Path

import pytest

from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.errors import RobotError
from roboglot.model.geometry import Pose
from roboglot.simulation.components.system.firmware import RESTART_SECONDS
from tests.protocols.cyberdog.phone import Messages
from tests.protocols.cyberdog.test_walks import STATUS
from tests.protocols.life import ADDRESS, BODIES, Life
from tests.protocols.lockstep import lockstep_runtime
from tests.protocols.mixed_clients import SYSTEM, Phone, Screen, Speaker
from tests.protocols.witness import Witness, seeds

ROUNDS = 40
PAUSES = [0, 0.02, 0.1, 0.5, 1, 3, 8]  # s
STILL = 0.03  # m/s that a robot at rest may report
SHOWN = {Posture.LIMP: (0,), Posture.LYING: (101,), Posture.STANDING: (111, 112)}  # motions of the dog's status


class MixedWalk:
    """All clients, and hands that put a box in the way."""

    def __init__(self, draw: random.Random, life: Life, witness: Witness) -> None:
        self._draw, self._life, self._witness = draw, life, witness
        self.screen, self._phone = Screen(draw, life, witness), Phone(draw, life, witness)
        self._speaker = Speaker(draw, witness)
        self._steps = [*self.screen.steps, *self._speaker.steps, *self._phone.steps, self._move_box]
        self._boxes: list[int] = []

    async def step(self) -> None:
        step = self._draw.choice(self._steps)
        if self.screen.stopped and self._draw.random() < 0.3:
            step = self.screen.stop
        await step()

    async def _move_box(self) -> None:
        stage = self._witness.world.stage
        if self._boxes and self._draw.random() < 0.6:
            stage.remove_obstacle(self._boxes.pop())
            return
        try:
            place = Pose(self._draw.uniform(1, 9), self._draw.uniform(1, 9))
            self._boxes.append(stage.add_obstacle(place, (0.4, 0.4, 0.6)))
        except RobotError as error:  # the robot is in the way
            self._witness.note("no box", str(error))

    async def check(self) -> None:
        self._phone.check()
        self._speaker.check()
        await self.screen.check()

    async def end(self) -> None:
        """Let all clients go, and assert that the doors agree about the robot at rest."""
        robot = self._witness.robot
        if Firmware in robot and robot[Firmware].restarting:  # programs go on until then
            await self._witness.pass_time(max(RESTART_SECONDS.values()))
        await self.screen.end()
        self._speaker.leave()
        await self._phone.end()
        await self._witness.pass_time(1.0)
        await self.screen.end()
        await self._witness.sees_it_rest(6.0)
        await self.check()
        await self._agree()

    async def _agree(self) -> None:
        reader, writer = await asyncio.open_connection(ADDRESS, 40923)

        async def ask(line: str) -> list[str]:
            writer.write(f"{line};".encode())
            return (await self._life.during(reader.readuntil(b";"))).decode().rstrip(";").split()

        await ask("command")
        (charge,), speeds = await ask("robot battery ?"), await ask("chassis speed ?")
        writer.close()
        assert max(abs(float(speed)) for speed in speeds[:2]) < STILL, speeds
        power = await self.screen.rest("GET", f"{SYSTEM}/power/status")
        if power.status_code == 200:
            assert abs(power.json()["batteryPercentage"] - float(charge)) <= 1, (power.text, charge)
            speed = (await self.screen.rest("GET", "/api/core/motion/v1/speed")).json()
            assert max(abs(speed[key]) for key in ("vx", "vy", "omega")) < STILL, speed
        status = json.loads((await self._life.during(self._life.phone.raw(STATUS)))[0][1])
        if Legs in self._witness.robot:
            posture, shown = self._witness.robot[Legs].posture, status["motion_status"]["motion_id"]
            assert shown in SHOWN.get(posture, (shown,)), (posture, shown)


@pytest.mark.parametrize("seed", seeds(0, 12))
async def test_four_clients_share_a_robot(seed: int, tmp_path: Path) -> None:
    draw = random.Random(seed)
    robots = [{"name": "a", "body": BODIES[(seed + 1) % len(BODIES)], "address": ADDRESS}]
    doors = "slamware", "cyberdog", "visual", "robomaster"
    runtime = await lockstep_runtime(tmp_path / "data", ADDRESS, *doors, robots=robots)
    life = Life(runtime, tmp_path / "data", Messages(tmp_path))

    async def forward(*, seconds: float) -> None:
        await life.forward(seconds)

    try:
        witness = Witness(runtime.fleet.world, runtime.fleet.robots["a"], forward)
        life.look = witness.look
        with witness.writing():
            await witness.pass_time(2.0)
            walk = MixedWalk(draw, life, witness)
            await walk.screen.name_places()
            for _ in range(ROUNDS):
                await walk.step()
                await witness.pass_time(draw.choice(PAUSES))
                await walk.check()
            await walk.end()
    finally:
        await life.close()
