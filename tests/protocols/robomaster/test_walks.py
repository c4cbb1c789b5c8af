"""Random walks: commands of several clients that overlap, connections cut in the middle, and what the robot does."""

from __future__ import annotations

import asyncio
import math
import random
import re
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.servo import Servos
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.drivers.settling import settle
from tests.protocols.robomaster.conftest import Connect
from tests.protocols.robomaster.text_client import TextClient
from tests.protocols.witness import Witness, seeds

ROUNDS = 40
PAUSES = [0, 0, 0.02, 0.06, 0.1, 0.3, 1.0, 2.0]  # s
WAITS = ["", "", " wait_for_complete true", " wait_for_complete false"]
WAITING_MAX = 3  # commands of a client without an answer
NAMES = ["ann", "bob", "cid", "dora", "eve", "fay", "gus", "hal"]
SILENCE_MAX = 90.0  # s that an answer may take: the longest motions
REPLY = re.compile(r"(ok|fail|Already in SDK mode|quit sdk mode failed|not in sdk mode|-?[\d.]+( -?[\d.]+)*);")

Line = str | Callable[[random.Random], str]


def number(draw: random.Random, top: float) -> float:
    return round(draw.uniform(-top, top), 2)


CHASSIS: list[Line] = [
    lambda d: f"chassis speed x {number(d, 1)} y {number(d, 1)} z {number(d, 200)}",
    lambda d: f"chassis speed x {number(d, 1)}",
    lambda d: f"chassis speed z {number(d, 300)}",
    "chassis speed x 0 y 0 z 0",
    lambda d: "chassis wheel " + " ".join(f"w{wheel} {number(d, 100)}" for wheel in range(1, 5)),
    lambda d: f"chassis move x {number(d, 1)} y {number(d, 1)} z {number(d, 180)} vxy 0.7 vz 90{d.choice(WAITS)}",
    lambda d: f"chassis move x {number(d, 0.6)}{d.choice(WAITS)}",
    "chassis stop",
    lambda d: f"robot mode {d.choice(['chassis_lead', 'gimbal_lead', 'free'])}",
]
JOINTS: list[Line] = [
    lambda d: f"gimbal speed p {number(d, 90)} y {number(d, 90)}",
    "gimbal speed p 0 y 0",
    "gimbal stop",
    lambda d: f"gimbal move p {number(d, 30)} y {number(d, 50)}{d.choice(WAITS)}",
    lambda d: f"gimbal moveto p {number(d, 25)} y {number(d, 200)} vp 100 vy 200{d.choice(WAITS)}",
    lambda d: f"gimbal recenter{d.choice(WAITS)}",
    lambda d: d.choice(["gimbal suspend", "gimbal resume", "gimbal resume"]),
    lambda d: f"robotic_arm move x {number(d, 5)} y {number(d, 5)}{d.choice(WAITS)}",
    lambda d: f"robotic_arm moveto x {number(d, 15)} y {number(d, 10)}{d.choice(WAITS)}",
    lambda d: f"robotic_arm {d.choice(['recenter', 'stop'])}",
    lambda d: f"robotic_gripper {d.choice(['open', 'close'])} {d.randint(1, 4)}",
    "robotic_gripper stop",
    lambda d: f"servo angle id {d.randint(1, 3)} angle {number(d, 180)}{d.choice(WAITS)}",
    lambda d: f"servo speed id {d.randint(1, 3)} speed {d.choice([0, number(d, 300)])}",
    "servo stop",
]
OTHERS: list[Line] = [
    "blaster fire",
    lambda d: d.choice(["chassis speed ?", "chassis position ?", "gimbal attitude ?", "robotic_gripper status ?"]),
    "chassis push position on freq 10",
    lambda d: d.choice(["quit", "command", "command", "command"]),
]
KINDS = [CHASSIS, CHASSIS, JOINTS, JOINTS, OTHERS]


@dataclass
class Speaker:
    """A client, and the commands that wait for their answers."""

    name: str
    client: TextClient
    sent: deque[tuple[float, str]] = field(default_factory=deque)
    reading: asyncio.Task[None] | None = None


class Walk:
    """Clients that come, speak and go."""

    def __init__(self, draw: random.Random, witness: Witness, connect: Connect) -> None:
        self._draw, self._witness, self._connect = draw, witness, connect
        self.speakers: list[Speaker] = []

    async def join(self) -> None:
        speaker = Speaker(self._draw.choice(NAMES), await self._connect())
        self.speakers.append(speaker)
        speaker.reading = asyncio.create_task(self._read(speaker))
        self._send(speaker, "command")

    async def step(self) -> None:
        """Let a client come, go or say something."""
        kind = self._draw.random()
        if kind < 0.05 and len(self.speakers) > 1:
            self.leave(self._draw.choice(self.speakers))
        elif kind < 0.1 and len(self.speakers) < 3:
            await self.join()
        else:
            speaker, line = self._draw.choice(self.speakers), self._draw.choice(self._draw.choice(KINDS))
            if len(speaker.sent) < WAITING_MAX:
                self._send(speaker, line if isinstance(line, str) else line(self._draw))

    def leave(self, speaker: Speaker) -> None:
        """Cut the connection, perhaps in the middle of a command."""
        half = self._draw.choice(["", "chassis speed x 1", "gimbal mo", "servo speed id 1 speed 90;chassis sp"])
        self._witness.note(speaker.name, "gone", half)
        speaker.client.send(half)
        self.speakers.remove(speaker)
        assert speaker.reading is not None
        speaker.reading.cancel()
        close = self._draw.choice([speaker.client.writer.close, speaker.client.writer.transport.abort])
        close()

    def check(self) -> None:
        """Assert that all answers are well-formed, and none is overdue."""
        for speaker in self.speakers:
            assert speaker.reading is not None
            if speaker.reading.done():
                speaker.reading.result()
            if speaker.sent:
                when, line = speaker.sent[0]
                assert self._witness.now - when < SILENCE_MAX, f"no answer to {line!r}"

    def _send(self, speaker: Speaker, line: str) -> None:
        speaker.sent.append((self._witness.now, line))
        self._witness.note(speaker.name, "->", line)
        speaker.client.send(line + ";")

    async def _read(self, speaker: Speaker) -> None:
        while True:
            reply = await speaker.client.reply()
            _, line = speaker.sent.popleft()
            self._witness.note(speaker.name, "<-", line, reply)
            assert REPLY.fullmatch(reply) or "?" in line, f"{line!r} is answered {reply!r}"
            if speaker.sent:
                speaker.sent[0] = self._witness.now, speaker.sent[0][1]


async def reports_agree(client: TextClient, robot: Robot) -> None:
    """Assert that a robot at rest reports what it is."""
    assert await client.ask("command;") == "ok;"
    speeds = await client.numbers("chassis speed ?;")
    assert max(map(abs, speeds[:2])) < 0.02, speeds
    pitch, yaw = await client.numbers("gimbal attitude ?;")
    assert math.radians(-yaw) == pytest.approx(robot[Gimbal].angles.yaw, abs=0.01)
    assert math.radians(-pitch) == pytest.approx(robot[Gimbal].attitude.pitch, abs=0.01)
    for id in range(1, robot[Servos].count + 1):
        [angle] = await client.numbers(f"servo angle id {id} ?;")
        assert math.radians(angle) == pytest.approx(robot[Servos].angle(id), abs=0.01)


@pytest.mark.parametrize("seed", seeds(2, 60))
@pytest.mark.world("empty", body="robomaster_ep")
async def test_random_commands_end_at_rest(
    seed: int, robot: Robot, world: World, forward: Forward, connect: Connect
) -> None:
    """After the walk all clients go; then no action runs, nothing moves, and the robot says so."""
    draw = random.Random(seed)
    world.stage.place("a", Pose(5.0, 5.0))
    witness = Witness(world, robot, forward)
    walk = Walk(draw, witness, connect)
    with witness.writing():
        await walk.join()
        await walk.join()
        for _ in range(ROUNDS):
            await settle()
            await walk.step()
            await witness.pass_time(draw.choice(PAUSES))
            walk.check()
        for speaker in list(walk.speakers):
            walk.leave(speaker)
        await witness.sees_it_rest(4.0)
        await reports_agree(await connect(), robot)
