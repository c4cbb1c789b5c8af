"""Random walks over a dog's app: motions, servo frames, tasks, voices and updates that overlap, and calls cut off."""

from __future__ import annotations

import asyncio
import json
import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import grpc
import pytest

from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.events import MapReplaced
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from roboglot.wire.cyberdog.codes import Feedback, TaskState, TaskType
from tests.drivers.settling import settle
from tests.protocols.cyberdog.phone import Client, Messages, Pems
from tests.protocols.witness import Witness, has_keys, walks

ROUNDS = 22
PAUSES = [0, 0.02, 0.06, 0.1, 0.3, 1, 3, 6]  # s
STOP, STAND, LIE = 0, 111, 101  # motions
SERVO, MOTION, STATUS, TASK, STOP_TASK, JOIN = 1002, 1004, 10001, 6004, 6009, 6010
DOWNLOAD, INSTALL, JOB, JOIN_JOB = 5003, 5004, 5010, 5011
MD5 = "0123456789abcdef0123456789abcdef"
MODULE = {
    "module": "l91.NX.OTA",
    "latest": {"version": "1.3.2.0", "packages": [{"md5": MD5, "fileSize": 30_000_000}]},
}
OFF = 0.4  # m from its goal at which a navigation may succeed
ENDLESS = 200.0  # s that a task may take which is not mapping
MOTION_MAX = 25.0  # s until a motion is answered, 321 at the latest
Params = dict[str, Any]


def number(draw: random.Random, top: float) -> float:
    return round(draw.uniform(-top, top), 2)


MOTIONS: list[Callable[[random.Random], Params]] = [
    lambda _: {"motion_id": STAND},
    lambda _: {"motion_id": LIE},
    lambda _: {"motion_id": STOP},
    lambda _: {"motion_id": STOP},
    lambda d: {"motion_id": 303, "vel_des": [number(d, 0.5), number(d, 0.2), number(d, 1)], "duration": 2000},
    lambda d: {"motion_id": 308, "vel_des": [number(d, 0.5), 0, 0], "duration": d.randint(100, 3000)},
    lambda d: {"motion_id": 211, "rpy_des": [0, number(d, 0.2), 0], "pos_des": [0, 0, 0.2], "duration": 500},
    lambda d: {"motion_id": 212, "rpy_des": [0, number(d, 0.2), 0], "duration": 500},
    lambda d: {"motion_id": d.choice([105, 110, 113, 121, 123, 126, 140, 141, 143, 146, 150, 309, 501])},
]
FRAMES: list[Callable[[random.Random], Params]] = [
    lambda d: {"motion_id": d.choice([303, 305, 308]), "cmd_type": 1, "vel_des": [number(d, 0.6), 0, number(d, 1)]},
    lambda d: {"motion_id": 303, "cmd_type": 1, "vel_des": [number(d, 0.6), 0, 0]},
    lambda d: {"motion_id": 201, "cmd_type": 1, "rpy_des": [0, number(d, 0.2), 0]},
    lambda _: {"motion_id": 303, "cmd_type": 2},
]
TASKS: list[Callable[[random.Random], tuple[int, Params]]] = [
    lambda d: (TASK, {"type": 1, "goalX": number(d, 3), "goalY": number(d, 3), "theta": number(d, 3)}),
    lambda d: (TASK, {"type": 1, "goalX": number(d, 3), "goalY": number(d, 3)}),
    lambda d: (TASK, {"type": 1, "goalX": number(d, 3), "goalY": number(d, 3)}),
    lambda _: (TASK, {"type": 5}),
    lambda _: (TASK, {"type": 9}),
    lambda d: (STOP_TASK, {"type": d.choice([0, 1, 1, 5, 9]), "map_name": d.choice(["", "home", "hall"])}),
    lambda d: (STOP_TASK, {"type": d.choice([1, 5]), "map_name": d.choice(["", "home"])}),
    lambda d: (JOIN, {"type": d.choice([1, 5, 7, 9])}),
    lambda d: (6003, {"mapName": d.choice(["", "home", "hall"])}),
    lambda d: (6002, {"mapName": d.choice(["home", "hall"]), "only_delete": d.random() < 0.5, "locationLabelInfo": []}),
    lambda d: (1100, {"data": d.random() < 0.5}),
    lambda _: (1101, {}),
]
OTHERS: list[Callable[[random.Random], tuple[int, Params]]] = [
    lambda _: (3001, {}),
    lambda d: (3002, {"uid": "7", "token_access": "a", "token_fresh": "b", "token_expires_in": d.choice(["9", "-1"])}),
    lambda d: (3011, {"nick_name": d.choice(["eva", "adam"]), "voiceprint_id": "p1"}),
    lambda _: (3012, {}),
    lambda d: (1012, {"volume": d.randint(-10, 110)}),
    lambda d: (1014, {"enable": d.random() < 0.5}),
    lambda _: (1025, {}),
    lambda d: (1020, {"member": d.choice(["eva", "adam"])}),
    lambda d: (d.choice([5001, 5002, 5005, 5006]), {}),
    lambda d: (DOWNLOAD, {"modules": d.choice([[MODULE], []])}),
    lambda d: (INSTALL, {"md5": d.choice([MD5, "f" * 32])}),
    lambda d: (JOB, {"id": 7, "operate": d.choice(["inquire", "download", "remove", "reset", "disk", "upgrade"])}),
    lambda d: (JOB, {"id": "x", "operate": d.choice(["download", "upgrade_and_reboot", "nothing"]), "data": [MODULE]}),
    lambda _: (JOIN_JOB, {}),
]


@dataclass
class Call:
    """A request that is open, and what came so far."""

    number: int
    code: int
    params: Params
    rpc: Any
    began: float
    answers: list[Any] = field(default_factory=list)
    reading: asyncio.Task[None] | None = None
    cut: bool = False


class Walk:
    """A phone's calls, and what has to follow from them."""

    def __init__(self, draw: random.Random, clients: list[Client], robot: Robot, witness: Witness) -> None:
        self._draw, self.clients, self._robot, self._witness = draw, clients, robot, witness
        self._calls: list[Call] = []
        self._numbers = 0
        self._stopped = False  # an emergency stop was answered, and nothing has been asked since that lifts it
        self._lifted = 0  # the last call that may
        self._joined = {JOIN: 0, JOIN_JOB: 0}  # the last call of each that takes over another one's stream
        self._origin = witness.pose
        robot.events.listen(MapReplaced, self._follow)

    def _follow(self, event: MapReplaced) -> None:
        if event.origin is not None:
            self._origin = self._witness.pose

    def open(self, code: int, params: Params) -> None:
        """Send a request, by either client."""
        self._numbers += 1
        self._witness.note(self._numbers, "->", code, params)
        if (code == MOTION and params["motion_id"] == STAND) or code in (INSTALL, JOB):  # a restarted dog may stand
            self._lifted, self._stopped = self._numbers, False
        if code in self._joined:
            self._joined[code] = self._numbers
        call = Call(self._numbers, code, params, self._draw.choice(self.clients).open(code, params), self._witness.now)
        call.reading = asyncio.create_task(self._read(call))
        self._calls.append(call)

    async def _read(self, call: Call) -> None:
        try:
            async for answer in call.rpc:
                call.answers.append(json.loads(answer.data) if answer.data else None)
        except (grpc.aio.AioRpcError, asyncio.CancelledError):
            assert call.cut, call
            return
        self._witness.note(call.number, "<-", call.code, call.answers)
        self._judge(call)

    def cut(self) -> None:
        """Cancel a call in the middle."""
        if self._calls:
            call = self._draw.choice(self._calls)
            self._witness.note(call.number, "cut")
            call.cut = True
            call.rpc.cancel()

    def hang_up(self) -> None:
        """Mark all calls as cut: the clients are gone."""
        for call in self._calls:
            call.cut = True

    def step(self) -> None:
        draw = self._draw
        kind = draw.random()
        if self._stopped and draw.random() < 0.3:
            self.open(MOTION, {"motion_id": STAND})
        elif kind < 0.3:
            self.open(MOTION, draw.choice(MOTIONS)(draw))
        elif kind < 0.42:
            self.open(SERVO, draw.choice(FRAMES)(draw))
        elif kind < 0.75:
            self.open(*draw.choice(TASKS)(draw))
        elif kind < 0.9:
            self.open(*draw.choice(OTHERS)(draw))
        elif kind < 0.95:
            self.open(STATUS, {})
        else:
            self.cut()

    def check(self) -> None:
        """Assert what has to hold at any moment."""
        for call in [call for call in self._calls if call.reading and call.reading.done()]:
            assert call.reading
            call.reading.result()
            self._calls.remove(call)
        for call in self._calls:
            assert call.code != MOTION or self._witness.now - call.began < MOTION_MAX, call
        if self._stopped:
            assert self._robot[Legs].posture is Posture.LIMP, f"{self._robot[Legs].posture} after an emergency stop"

    # -- answers -------------------------------------------------------------------------------------------------------

    def _judge(self, call: Call) -> None:
        """Assert that the answers to a call are in the manual's form, and true."""
        match call.code:
            case 1004:
                self._judge_motion(call)
            case 6004 | 6010:
                self._judge_task(call)
            case 5010:
                assert call.answers[0] in ({"accepted": 1}, {"accepted": 2}), call
                short = call.answers[0] == {"accepted": 2} or call.number < self._joined[JOIN_JOB]  # or taken over
                assert short or has_keys(call.answers[-1], {"id": (int, str), "operate": str, "code": int}), call
            case 10001:
                [answer] = call.answers
                TaskState(answer["task_status"]["task_status"])
            case 1002 | 3001 | 3002 | 3011 | 3012 | 6010 | 5011:
                pass
            case _:
                assert len(call.answers) == 1, call

    def _judge_motion(self, call: Call) -> None:
        [answer] = call.answers
        if "error_code" in answer:
            return
        assert has_keys(answer, {"motion_id": int, "result": bool, "code": int}), call
        assert answer["motion_id"] == call.params["motion_id"]
        assert answer["result"] == (answer["code"] == 0), call
        posture = self._robot[Legs].posture
        wanted = {STOP: Posture.LIMP, STAND: Posture.STANDING, LIE: Posture.LYING}.get(answer["motion_id"])
        if answer["result"] and wanted:
            assert posture is wanted, f"{posture} after {call}"
        if answer["result"] and wanted is Posture.LIMP and call.number > self._lifted:
            self._stopped = True

    def _judge_task(self, call: Call) -> None:
        first, *between, last = [*call.answers, {}]
        if "error_code" in first:
            return
        assert has_keys(first, {"accepted": int}), call
        if first["accepted"] != 1:
            assert call.answers == [first], call
            return
        *between, last = between
        assert all(has_keys(one, {"feedback_code": int, "feedback_msg": str}) for one in between), call
        for one in between:
            Feedback(one["feedback_code"])
        taken_over = call.number < self._joined[JOIN] and "result" not in last
        assert taken_over or last in ({"result": 0}, {"result": 3}, {"result": 5}), call
        if last == {"result": 0} and call.code == TASK and call.params["type"] == TaskType.NAVIGATION:
            goal = self._origin.compose(Pose(call.params["goalX"], call.params["goalY"]))
            off = math.dist((goal.x, goal.y), (self._witness.pose.x, self._witness.pose.y))
            assert off < OFF, f"{call} succeeded {off:.2f} m from its goal"


@pytest.mark.parametrize(("seed", "rounds"), walks(ROUNDS, 60))
@pytest.mark.world("empty", body="cyberdog2")
async def test_random_calls_end_at_rest(
    seed: int,
    rounds: int,
    robot: Robot,
    world: World,
    door: CyberDogDoor,
    pems: Pems,
    messages: Messages,
    forward: Forward,
) -> None:
    """After an emergency stop nothing but 111 has the dog get up; when its clients are gone, it comes to rest."""
    draw = random.Random(seed)
    witness = Witness(world, robot, forward)
    with witness.writing():
        await witness.pass_time(1.0)
        async with pems.channel(door.port) as first, pems.channel(door.port) as second:
            walk = Walk(draw, [Client(first, messages), Client(second, messages)], robot, witness)
            walk.open(TASK, {"type": 7})  # once: a dog that has moved much searches the whole map for minutes
            await pass_time(walk, witness, 2.0)
            for _ in range(rounds):
                walk.step()
                await settle()
                await pass_time(walk, witness, draw.choice(PAUSES))
            walk.hang_up()
        await pass_time(walk, witness, 1.0)
        await witness.sees_it_rest(ENDLESS)
        walk.check()


async def pass_time(walk: Walk, witness: Witness, seconds: float) -> None:
    """Let time pass, and check."""
    walk.check()
    while seconds > 1e-9:
        await witness.pass_time(min(0.1, seconds))
        seconds -= 0.1
        walk.check()
