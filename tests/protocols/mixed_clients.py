"""A Slamware client, one of the text protocol, and an app of a dog, each judged by the answers it got."""

from __future__ import annotations

import asyncio
import math
import random
from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any

import grpc

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.geometry import Point, Pose
from tests.protocols.cyberdog.test_walks import FRAMES, MOTION, MOTIONS, SERVO, STAND, STOP, STOP_TASK, TASK
from tests.protocols.life import ADDRESS, Life
from tests.protocols.robomaster.test_walks import CHASSIS, JOINTS, REPLY, WAITING_MAX
from tests.protocols.witness import Witness

ACTIONS = "/api/core/motion/v1/actions"
TASKS = "/api/delivery/v1/tasks"
SYSTEM = "/api/core/system/v1"
OFF = 0.5  # m from its goal at which a move may succeed
SILENCE_MAX = 120.0  # s that a command may wait for its answer, behind two others
ENDLESS = 500.0  # s that an action may take
PROGRAM = """
import random
random.seed({seed})
while True:
    n = random.randrange(8)
    if n == 0: cyberdog.motion.turn(random.uniform(-180, 180), random.uniform(0, 2))
    elif n == 1: cyberdog.motion.go_straight(random.uniform(-0.5, 0.5), random.uniform(0, 1))
    elif n == 2: cyberdog.motion.go_straight(random.uniform(-0.5, 0.5), 0, random.uniform(0, 2))
    elif n == 3: cyberdog.motion.bow()
    elif n == 4: cyberdog.motion.get_down()
    elif n == 5: cyberdog.motion.go_straight(0.4, 0, 0)
    else: time.sleep(random.uniform(0, 2))
"""

Options = dict[str, Any]
Step = Callable[[], Coroutine[Any, Any, None]]


class Screen:
    """A Slamware client: it moves, delivers, stops, sleeps, restarts and clears."""

    def __init__(self, draw: random.Random, life: Life, witness: Witness) -> None:
        self._draw, self._life, self._witness = draw, life, witness
        self._robot, self._origin = witness.robot, witness.pose
        self._begun: dict[int, float] = {}  # s, by action
        self._goals: dict[int, Point] = {}  # in the world
        self._ended: dict[int, Options] = {}
        self.stopped = False
        self.steps: list[Step] = [self._begin] * 5 + [self._deliver] * 2
        self.steps += [self._abort, self.stop, self._sleep, self._restart, self._change_map]

    async def rest(self, method: str, url: str, **content: Any) -> Any:
        """Return an answer that is none of a broken server."""
        reply = await self._life.rest(method, url, **content)
        self._witness.note(method, url, content.get("json"), reply.status_code, reply.text[:90])
        assert reply.status_code < 500 or reply.status_code in (501, 503), reply.text
        return reply

    async def name_places(self) -> None:
        for name in "pq":
            place = {"id": name, "pose": {**self._spot(), "yaw": 0}, "metadata": {"display_name": name}}
            await self.rest("POST", "/api/core/artifact/v1/pois", json=place)
        await self.rest("POST", "/api/multi-floor/map/v1/stcm/:sync")

    def _spot(self) -> dict[str, float]:
        there = Pose(self._draw.uniform(1, 9), self._draw.uniform(1, 9)).relative_to(self._origin)
        return {"x": round(there.x, 2), "y": round(there.y, 2)}

    async def _begin(self) -> None:
        draw = self._draw
        turned = {"mode": 0, "flags": ["with_yaw"], "yaw": 1.0}
        kinds: list[tuple[str, Options]] = [
            ("MoveTo", {"target": self._spot(), "move_options": turned}),
            ("MoveTo", {"target": self._spot()}),
            ("SeriesMoveTo", {"targets": [self._spot(), self._spot()]}),
            ("MoveBy", {"direction": draw.randint(0, 3)}),
            ("MoveBy", {"direction": draw.randint(0, 3), "duration": 1500}),
            ("Rotate", {"angle": draw.uniform(-7, 7)}),
            ("GoHome", {}),
            ("Sweep", {}),
            ("JackMove", {"move_direction": draw.choice(["Up", "Down"])}),
            ("JackTopMoveTo", {"target": self._spot()}),
            ("BackOffFromTag", {"backup_distance": 0.3}),
            ("MoveToTag", {"target": self._spot(), "move_to_tag_options": {}}),
            ("MultiFloorMove", {"target": {"poi_name": draw.choice("pq")}}),
            ("EnterElevator", {"elevator_id": "x"}),
            ("ReturnToParking", {}),
        ]
        name, options = draw.choice(kinds)
        body = {"action_name": f"slamtec.agent.actions.{name}Action", "options": options}
        reply = await self.rest("POST", ACTIONS, json=body)
        if reply.status_code != 200:
            return
        id = reply.json()["action_id"]
        self._begun[id] = self._witness.now
        if name == "MoveTo" and self._robot[Localization].quality > 0.9:
            target = Pose(**options["target"]).relative_to(self._robot[Localization].pose)
            self._goals[id] = self._witness.pose.compose(target).point

    async def _abort(self) -> None:
        await self.rest("DELETE", f"{ACTIONS}/:current")

    async def stop(self) -> None:
        """Press the emergency stop, or release it."""
        if EmergencyStop not in self._robot:
            return
        stop = not self.stopped
        if not stop:
            self._set_stopped(stop)  # it may move at once
        value = {"param": "base.emergency_stop", "value": "on" if stop else "off"}
        assert (await self.rest("PUT", f"{SYSTEM}/parameter", json=value)).status_code == 200
        self._set_stopped(stop)

    def _set_stopped(self, stopped: bool) -> None:
        self.stopped = stopped
        self._witness.stopped_at = self._witness.now if stopped else math.inf

    async def _sleep(self) -> None:
        await self.rest("POST", f"{SYSTEM}/power/:{self._draw.choice(['hibernate', 'wakeup', 'wakeup'])}")

    async def _restart(self) -> None:
        kind = self._draw.choice(["RestartModeSoft", "RestartModeBase", None, None])
        if kind is not None:
            reply = await self.rest("POST", f"{SYSTEM}/power/:restartmodule", json={"mode": kind})
            if kind == "RestartModeBase" and reply.status_code == 200 and self.stopped:
                self._set_stopped(False)

    async def _deliver(self) -> None:
        draw, kind = self._draw, self._draw.random()
        if kind < 0.5:
            cargos = draw.choice([None, [{"boxes": [{"id": "1"}]}]])
            order = {"location": {"poi_name": draw.choice("pq")}, "type": "TAKEOUT", "cargos": cargos}
            await self.rest("POST", f"{TASKS}/:batch", json=[order])
        elif kind < 0.6:
            await self.rest("DELETE", TASKS)
        elif kind < 0.8:
            enabled = {"enable_task_execution": draw.random() < 0.6}
            await self.rest("PUT", f"{TASKS}/:task_execution", json=enabled)
        else:
            verb = draw.choice(["start_pickup", "end_pickup", "end_operation", "task_finish"])
            await self.rest("PUT", f"{TASKS}/:{verb}", json={})

    async def _change_map(self) -> None:
        if self._draw.random() < 0.5:
            await self.rest("DELETE", "/api/core/slam/v1/maps")
            self._goals.clear()
        else:
            new = {"new_origin": {"x": self._draw.randint(-3, 3), "y": 1.0}}
            await self.rest("PUT", "/api/core/slam/v1/maps/origin", json=new)

    async def check(self) -> None:
        """Assert that actions end in time, stay ended, and that those that succeed are where they wanted to be."""
        for id in list(self._begun)[-8:]:
            reply = await self._life.rest("GET", f"{ACTIONS}/{id}")
            if reply.status_code == 503:
                return
            assert reply.status_code == 200, reply.text
            info, state = reply.json(), reply.json()["state"]
            if id in self._ended:
                assert info == self._ended[id]
            elif state["status"] == 4:
                self._ended[id] = info
                self._witness.note(id, "ended", state)
                assert (state["result"] == 0) == (state["reason"] == ""), state
                if id in self._goals and state["result"] == 0:
                    assert self._goals[id].distance_to(self._witness.ends[id]) < OFF, (id, self._goals[id])
            else:
                assert self._witness.now - self._begun[id] < ENDLESS, f"{id} does not end"
        if not self._robot.actions.running():
            assert (await self._life.rest("GET", f"{ACTIONS}/:current")).status_code == 404

    async def end(self) -> None:
        if self.stopped:
            await self.stop()
        await self.rest("POST", f"{SYSTEM}/power/:wakeup")
        await self.rest("PUT", f"{TASKS}/:task_execution", json={"enable_task_execution": False})
        await self.rest("DELETE", TASKS)
        await self._abort()


class Speaker:
    """A client of the text protocol that comes and goes."""

    def __init__(self, draw: random.Random, witness: Witness) -> None:
        self._draw, self._witness = draw, witness
        self._writer: asyncio.StreamWriter | None = None
        self._sent: deque[tuple[float, str]] = deque()
        self._reading: asyncio.Task[None] | None = None
        self.steps: list[Step] = [self._speak] * 6

    async def _speak(self) -> None:
        if self._writer is None:
            reader, self._writer = await asyncio.open_connection(ADDRESS, 40923)
            self._sent.clear()
            self._reading = asyncio.create_task(self._read(reader))
            self._send("command")
        elif self._draw.random() < 0.08:
            self._witness.note("text", "gone")
            self.leave()
        elif len(self._sent) < WAITING_MAX:
            line = self._draw.choice(self._draw.choice([CHASSIS, CHASSIS, JOINTS]))
            self._send(line if isinstance(line, str) else line(self._draw))

    def _send(self, line: str) -> None:
        assert self._writer is not None
        self._sent.append((self._witness.now, line))
        self._witness.note("text ->", line)
        self._writer.write(f"{line};".encode())

    async def _read(self, reader: asyncio.StreamReader) -> None:
        while True:
            try:
                reply = (await reader.readuntil(b";")).decode()
            except asyncio.IncompleteReadError:
                self._witness.note("text", "closed")
                self.leave()
                return
            _, line = self._sent.popleft()
            self._witness.note("text <-", line, reply)
            assert REPLY.fullmatch(reply), (line, reply)
            if self._sent:  # its turn begins now
                self._sent[0] = self._witness.now, self._sent[0][1]

    def leave(self) -> None:
        if self._reading is not None and self._reading is not asyncio.current_task():
            self._reading.cancel()
        if self._writer is not None:
            self._writer.close()
        self._writer = None

    def check(self) -> None:
        """Assert that no answer is malformed or overdue."""
        if self._reading is not None and self._reading.done() and not self._reading.cancelled():
            self._reading.result()
        if self._sent and self._writer is not None:
            assert self._witness.now - self._sent[0][0] < SILENCE_MAX, self._sent[0]


class Phone:
    """The app of a dog, and the block programs of its owner."""

    def __init__(self, draw: random.Random, life: Life, witness: Witness) -> None:
        self._draw, self._life, self._witness = draw, life, witness
        self._calls: list[asyncio.Task[None]] = []
        self._number = self._got_up = 0  # of calls
        self._limp = False
        self.steps: list[Step] = [self._call] * 5 + [self._run_program] * 2

    async def _call(self) -> None:
        draw = self._draw
        goal = {"type": 1, "goalX": draw.uniform(-3, 3), "goalY": draw.uniform(-3, 3)}
        kinds: list[tuple[int, Options]] = [
            (MOTION, draw.choice(MOTIONS)(draw)),
            (MOTION, draw.choice(MOTIONS)(draw)),
            (SERVO, draw.choice(FRAMES)(draw)),
            (TASK, goal),
            (STOP_TASK, {"type": 1}),
            (TASK, {"type": 9}),
            (1100, {"data": draw.random() < 0.5}),
        ]
        code, params = draw.choice(kinds)
        self._number += 1
        if code == MOTION and params["motion_id"] == STAND:
            self.forget_posture()
        self._witness.note("dog ->", code, params)
        self._calls.append(asyncio.create_task(self._hear(code, params, self._number)))

    async def _hear(self, code: int, params: Options, number: int) -> None:
        try:
            answers = [answer.data async for answer in self._life.phone.open(code, params)]
        except (grpc.aio.AioRpcError, asyncio.CancelledError) as error:
            self._witness.note("dog cut off", code, repr(error)[:80])
            return
        self._witness.note("dog <-", code, params, answers[-2:])
        stopped = code == MOTION and params["motion_id"] == STOP and '"result":true' in answers[-1]
        self._limp |= stopped and number > self._got_up and Legs in self._witness.robot

    def forget_posture(self) -> None:
        """Know no more that the dog is limp."""
        self._got_up, self._limp = self._number, False

    async def _run_program(self) -> None:
        verb = self._draw.choice(["run", "run", "suspend", "recover", "shutdown"])
        if verb == "run":
            body = PROGRAM.replace("{seed}", str(self._draw.random()))
            await self._operate("save", mode="single", condition="now", body=body)
        self._witness.note("program", verb, await self._operate(verb))

    async def _operate(self, verb: str, **more: str) -> object:
        return await self._life.visual({"operate": verb, "type": "task", "target_id": ["t"], **more})

    def check(self) -> None:
        """Assert that a stopped dog does not get up by itself."""
        for call in [call for call in self._calls if call.done()]:
            call.result()
            self._calls.remove(call)
        if self._limp:
            assert self._witness.robot[Legs].posture is Posture.LIMP

    async def end(self) -> None:
        await self._operate("shutdown")
        for call in self._calls:
            call.cancel()
        for kind in (1, 9):
            await self._life.dog(STOP_TASK, {"type": kind})
