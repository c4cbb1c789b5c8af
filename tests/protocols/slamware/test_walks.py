"""Random walks: actions that overlap, replace and abort each other, and everything that hinders them.

A robot in a hall with a dock: people push boxes in its way, draw walls, clear the map, move its origin, load it again.
"""

from __future__ import annotations

import math
import random
from collections.abc import Awaitable, Callable
from typing import Any

import httpx
import pytest

from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.motion.base import Base
from roboglot.model.errors import RobotError
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.protocols.slamware.judge import Judge
from tests.protocols.witness import GRACE, Witness, walks

ROUNDS = 25
PAUSES = [0, 0.02, 0.1, 0.3, 0.6, 1.0, 3.0, 8.0, 15.0]  # s
ACTIONS, SLAM = "/api/core/motion/v1/actions", "/api/core/slam/v1"
PARAMETER, WALLS = "/api/core/system/v1/parameter", "/api/core/artifact/v1/lines/walls"
CHECKED = 12  # actions that are looked at
OFF = 0.4  # m from its goal at which an action may succeed
LOST = 0.35  # m by which a robot that is sure of its place may be wrong
ENDLESS = 400.0  # s that an action may take

Options = dict[str, Any]


class Walk:
    """A client of the REST door, who compares its answers with the world."""

    def __init__(self, draw: random.Random, judge: Judge, world: World, robot: Robot, witness: Witness) -> None:
        self._draw, self._judge, self._world, self._robot, self.witness = draw, judge, world, robot, witness
        self._known: dict[int, tuple[str, Point | None, float]] = {}  # name, goal in the world, beginning
        self._ended: dict[int, Options] = {}
        self._origin = witness.pose  # of the map, in the world
        self._walls: list[tuple[Point, Point]] = []  # in the world
        self._boxes: list[int] = []
        self.stopped = False

    def _number(self, low: float, high: float) -> float:
        return round(self._draw.uniform(low, high), 2)

    def _spot(self) -> Options:
        """A place in the hall, as the client has to say it, on the map."""
        there = Pose(self._number(0.5, 9.5), self._number(0.5, 9.5)).relative_to(self._origin)
        return {"x": round(there.x, 3), "y": round(there.y, 3)}

    def _how(self) -> Options:
        draw = self._draw
        how = {"mode": 0, "flags": [], "acceptable_precision": 0.1, "fail_retry_count": 0}
        if draw.random() < 0.3:
            how |= {"flags": ["with_yaw"], "yaw": self._number(-3, 3)}
        return how | {"speed_ratio": draw.choice([0, 0.3, 1.0])}

    def _action(self) -> tuple[str, Options]:
        draw, number = self._draw, self._number
        kinds: list[Callable[[], tuple[str, Options]]] = [
            lambda: ("MoveToAction", {"target": self._spot(), "move_options": self._how()}),
            lambda: ("MoveToAction", {"target": self._spot(), "move_options": self._how()}),
            lambda: ("SeriesMoveToAction", {"targets": [self._spot(), self._spot()], "move_options": self._how()}),
            lambda: ("FollowPathPointsAction", {"path_points": [self._spot()]}),
            lambda: ("MoveByAction", {"direction": draw.randint(0, 3), "duration": draw.choice([100, 500, 2000])}),
            lambda: ("MoveByAction", {"direction": draw.randint(0, 3)}),
            lambda: ("MoveByAction", {"theta": number(-1, 1)}),
            lambda: ("RotateAction", {"angle": number(-7, 7)}),
            lambda: ("RotateToAction", {"angle": number(-3, 3)}),
            lambda: ("GoHomeAction", {"gohome_options": {"flags": draw.choice(["dock", "no_dock"])}}),
            lambda: ("GoHomeAction", {}),
            lambda: ("RecoverLocalizationAction", {}),
            lambda: ("ReturnToParkingAction", {}),
            lambda: ("MultiFloorBackHomeAction", {}),
            lambda: ("JackMoveAction", {"move_direction": draw.choice(["Up", "Down"])}),
            lambda: ("MultiFloorMoveAction", {"target": {"pose": {**self._spot(), "yaw": 0}}}),
        ]
        return draw.choice(kinds)()

    async def begin(self) -> None:
        """Start an action."""
        name, options = self._action()
        reply = await self._judge.post(
            ACTIONS, json={"action_name": f"slamtec.agent.actions.{name}", "options": options}
        )
        assert reply.status_code in (200, 400), reply.text
        if reply.status_code == 200:
            id = reply.json()["action_id"]
            self._known[id] = name, self._goal(options), self.witness.now
            self.witness.note(id, name, options)

    def _goal(self, options: Options) -> Point | None:
        """The place where an action has to end, in the world: it stays there when the map gets another origin."""
        goals = options.get("targets") or options.get("path_points") or [options.get("target")]
        goal = (goals[-1] or {}).get("pose", goals[-1])
        return self._in_world(goal) if goal else None

    async def abort(self) -> None:
        self.witness.note("abort")
        assert (await self._judge.delete(f"{ACTIONS}/:current")).status_code == 200

    async def _set(self, name: str, value: str) -> None:
        self.witness.note(name, value)
        assert (await self._judge.put(PARAMETER, json={"param": name, "value": value})).status_code == 200

    async def stop(self) -> None:
        """Press or release the emergency stop."""
        self.stopped = not self.stopped
        await self._set("base.emergency_stop", "on" if self.stopped else "off")
        self.witness.stopped_at = self.witness.now if self.stopped else math.inf

    async def release(self) -> None:
        """Release the brake, or let it hold."""
        self.witness.rolls = not self.witness.rolls
        await self._set("base.brake_release", "on" if self.witness.rolls else "off")

    async def limit(self) -> None:
        await self._set("base.max_moving_speed", str(self._number(0.1, self._robot[Base].limits.twist.x)))

    async def draw_wall(self) -> None:
        """Draw a virtual wall, or remove all."""
        if self._walls and self._draw.random() < 0.5:
            self._walls.clear()
            await self._judge.delete(WALLS)
        else:
            wall = {"start": self._spot(), "end": self._spot()}
            self._walls.append((self._in_world(wall["start"]), self._in_world(wall["end"])))
            assert (await self._judge.post(WALLS, json=[wall])).status_code == 200
        self.witness.note("walls", self._walls)

    async def put_box(self) -> None:
        stage = self._world.stage
        try:
            if self._boxes and self._draw.random() < 0.6:
                stage.remove_obstacle(self._boxes.pop())
            else:
                place = Pose(self._number(1, 9), self._number(1, 9))
                self._boxes.append(stage.add_obstacle(place, (0.4, 0.4, 0.6)))
            self.witness.note("boxes", self._boxes)
        except RobotError as error:
            self.witness.note("no box", str(error))

    async def plug(self) -> None:
        on = self._draw.random() < 0.4
        self.witness.note("plug", on)
        self._world.stage.plug_in("a", on)

    async def clear_map(self) -> None:
        """Begin a new map here; drawings stay where they are."""
        self.witness.note("clear map")
        assert (await self._judge.delete(f"{SLAM}/maps")).status_code == 200
        self._origin = self.witness.pose

    async def move_origin(self) -> None:
        new = self._spot()
        self.witness.note("origin", new)
        reply = await self._judge.put(f"{SLAM}/maps/origin", json={"new_origin": new})
        assert reply.status_code == 200, reply.text
        self._origin = self._origin.compose(Pose(round(new["x"] / 0.05) * 0.05, round(new["y"] / 0.05) * 0.05))

    async def load_map(self) -> None:
        """Save the map, load it, and say where the robot stands."""
        here = self.witness.pose.relative_to(self._origin)
        self.witness.note("load map")
        saved = await self._judge.get(f"{SLAM}/maps/stcm")
        assert (await self._judge.put(f"{SLAM}/maps/stcm", content=saved.content)).status_code == 200
        pose = {"x": here.x, "y": here.y, "yaw": here.yaw}
        assert (await self._judge.put(f"{SLAM}/localization/pose", json=pose)).status_code == 200

    async def reload_map(self) -> None:
        """The same by the map on disk."""
        here = self.witness.pose.relative_to(self._origin)
        self.witness.note("reload map")
        api = "/api/multi-floor/map/v1/stcm"
        assert (await self._judge.post(f"{api}/:save")).status_code == 200
        pose = {"x": here.x, "y": here.y, "yaw": here.yaw}
        assert (await self._judge.post(f"{api}/:reload", json={"pose": pose})).status_code == 200

    def _in_world(self, point: Options) -> Point:
        return self._origin.compose(Pose(point["x"], point["y"])).point

    # -- what must hold ------------------------------------------------------------------------------------------------

    async def check(self) -> None:
        """Assert that what the door reports is true."""
        await self._check_actions()
        power = (await self._judge.get("/api/core/system/v1/power/status")).json()
        assert (power["dockingStatus"] == "on_dock") == self._robot[DockContact].docked, power
        await self._check_place()
        speed = (await self._judge.get("/api/core/motion/v1/speed")).json()
        if not self._robot.actions.running() and not self.witness.rolls and self.witness.now - self._last > 2 * GRACE:
            assert max(map(abs, (speed["vx"], speed["vy"], speed["omega"]))) < 0.05, speed

    @property
    def _last(self) -> float:
        """Time at which the last action ended, s."""
        return max((action.ended_at for action in self._robot.actions.history), default=0.0)

    async def _check_place(self) -> None:
        said = (await self._judge.get(f"{SLAM}/localization/pose")).json()
        sure = (await self._judge.get(f"{SLAM}/localization/quality")).json()
        off = self._in_world(said).distance_to(self.witness.pose)
        assert off < LOST or sure < 50, f"it takes itself to be {off:.2f} m off, at {said}, with quality {sure}"
        walls = [(self._in_world(line["start"]), self._in_world(line["end"])) for line in await self._lines()]
        assert len(walls) == len(self._walls)
        for drawn, wall in zip(self._walls, walls, strict=True):
            assert max(a.distance_to(b) for a, b in zip(drawn, wall, strict=True)) < LOST, (self._walls, walls)

    async def _lines(self) -> list[Options]:
        lines: list[Options] = (await self._judge.get(WALLS)).json()
        return sorted(lines, key=lambda line: line["id"])

    async def _check_actions(self) -> None:
        reply = await self._judge.get(f"{ACTIONS}/:current")
        current = reply.json() if reply.status_code == 200 else None
        live = []
        for id in list(self._known)[-CHECKED:]:
            reply = await self._judge.get(f"{ACTIONS}/{id}")
            assert reply.status_code == 200, (id, reply.text)
            info = reply.json()
            if id in self._ended:
                assert info == self._ended[id], "an action that ended changes"
            elif info["state"]["status"] == 4:
                self._ended[id] = info
                self.witness.note(id, "ended", info["state"])
                self._judge_end(id, info["state"])
            else:
                live.append(id)
                assert self.witness.now - self._known[id][2] < ENDLESS, f"{id} {self._known[id][0]} goes on for ever"
        assert (current is None) == (not live), (current, live)
        assert current is None or current["action_id"] == max(live), (current, live)

    def _judge_end(self, id: int, state: Options) -> None:
        """Assert that a failure has a reason, and that a success is one."""
        assert (state["result"] == 0) == (state["reason"] == ""), state
        name, goal, _ = self._known[id]
        if state["result"] == 0 and goal is not None:
            off = goal.distance_to(self.witness.pose)
            assert off < OFF, f"{id} {name} succeeded {off:.2f} m from its goal"

    @property
    def steps(self) -> list[Callable[[], Awaitable[None]]]:
        """All steps, those that are to come more often several times."""
        rare = [self.release, self.limit, self.draw_wall, self.put_box, self.put_box, self.plug]
        maps = [self.clear_map, self.move_origin, self.load_map, self.reload_map]
        return [*[self.begin] * 14, *[self.abort] * 3, *[self.stop] * 2, *rare, *maps]

    async def step(self) -> None:
        """Do one of them; a stop and a released brake do not last."""
        step = self._draw.choice(self.steps)
        if (self.stopped or self.witness.rolls) and self._draw.random() < 0.5:
            step = self.stop if self.stopped else self.release
        await step()


@pytest.mark.parametrize(("seed", "rounds"), walks(ROUNDS, 40))
@pytest.mark.world("empty", body="hermes")
async def test_random_requests_end_at_rest(
    seed: int, rounds: int, robot: Robot, world: World, client: httpx.AsyncClient, forward: Forward
) -> None:
    """The door says what is true all the time; after an abort nothing runs and nothing moves."""
    draw = random.Random(seed)
    witness = Witness(world, robot, forward)
    with witness.writing():
        await witness.pass_time(1.0)
        walk = Walk(draw, await Judge.of(client), world, robot, witness)
        for _ in range(rounds):
            await walk.step()
            await witness.pass_time(draw.choice(PAUSES))
            await walk.check()
        await walk.abort()
        await witness.sees_it_rest(4.0)
        await walk.check()
