"""Random walks on two floors: drawings, origins, saved maps, stops and rides given up in between."""

from __future__ import annotations

import math
import random
from typing import Any

import httpx
import pytest

from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.protocols.slamware.lift.two_floors import ACTIONS, MAPS, MULTI, map_two_floors, on_map, start
from tests.protocols.witness import Witness, seeds

WALLS, SLAM = "/api/core/artifact/v1/lines/walls", "/api/core/slam/v1"
LOST = 0.35  # m
ROUNDS = 12
PAUSES = [1, 2, 5, 20, 45]  # s

Options = dict[str, Any]


class FloorWalk:
    """A client that draws on each floor and sends the robot up and down."""

    def __init__(self, draw: random.Random, client: httpx.AsyncClient, witness: Witness, origin: Pose) -> None:
        self._draw, self._client, self.witness = draw, client, witness
        self._saved, self._origins = origin, [origin, origin]  # a floor that is entered again has the file's
        self._entered = "ground"
        self._walls: list[list[Point]] = [[], []]  # starts, in the world
        self._actions: dict[int, int | None] = {}
        self._ended: dict[int, Options] = {}
        self._stopped = self._broken = self._rested = False
        self._box: int | None = None

    @property
    def floor(self) -> int:
        return self.witness.world.truth.floor_of("a")

    @property
    def at_rest(self) -> bool:
        lift = self.witness.world.building.lift
        return lift is not None and lift.rests and not self.witness.running and self.floor < len(MAPS)

    async def step(self) -> None:
        steps = [self.go] * 5 + [self.abort, self.stop, self.fail, self.call, self.box, self.restart]
        steps += [self.draw, self.draw, self.origin, self.reload, self.sync, self.enter, self.pose]
        step = self._draw.choice(steps)
        if self._stopped and self._draw.random() < 0.6:
            step = self.stop
        self.witness.note(step.__name__, "floor", self.floor, self.witness.pose)
        await step()

    async def go(self) -> None:
        goal = on_map(Point(self._draw.uniform(4.0, 8.0), 10.0), self._origins[min(self.floor, 1)])
        kinds: list[tuple[str, Options, int | None]] = [
            ("MultiFloorMoveAction", {"target": {"poi_name": "upstairs"}}, 1),
            ("MultiFloorMoveAction", {"target": {"poi_name": "downstairs"}}, 0),
            ("MoveToAction", {"target": {"x": goal.x, "y": goal.y}}, None),
            ("MultiFloorBackHomeAction", {}, 0),
        ]
        name, options, floor = self._draw.choice(kinds)
        id = await start(self._client, name, **options)
        self._actions[id] = floor
        self.witness.note(id, name, options)

    async def abort(self) -> None:
        await self._client.delete(f"{ACTIONS}/:current")

    async def stop(self) -> None:
        self._stopped = not self._stopped
        value = {"param": "base.emergency_stop", "value": "on" if self._stopped else "off"}
        assert (await self._client.put("/api/core/system/v1/parameter", json=value)).status_code == 200
        self.witness.stopped_at = self.witness.now if self._stopped else math.inf

    async def fail(self) -> None:
        self._broken = not self._broken
        faults = self.witness.world.faults
        if self._broken:
            faults.inject(self._draw.choice(["lift_out_of_service", "lift_door_blocked", "lift_occupied"]))
        else:
            faults.clear()

    async def call(self) -> None:
        if not self._broken:
            self.witness.robot[LiftClient].call(self._draw.randint(0, 1))

    async def box(self) -> None:
        stage = self.witness.world.stage
        if self._box is not None:
            stage.remove_obstacle(self._box)
            self._box = None
        elif self.witness.pose.distance_to(Point(2.6, 10.0)) > 1.2:
            self._box = stage.add_obstacle(Pose(2.6, 10.0), (0.4, 0.4, 0.6), self._draw.randint(0, 1))

    async def restart(self) -> None:
        kind = self._draw.choice(["RestartModeSoft", "RestartModeBase"])
        reply = await self._client.post("/api/core/system/v1/power/:restartmodule", json={"mode": kind})
        self.witness.note(kind, reply.status_code, reply.text)
        if kind == "RestartModeSoft" and reply.status_code == 200:  # loads the saved map
            self._origins = [self._saved, self._saved]

    async def draw(self) -> None:
        if not self.at_rest:
            return
        if self._walls[self.floor] and self._draw.random() < 0.3:
            self._walls[self.floor].clear()
            await self._client.delete(WALLS)
            return
        there = Point(self._draw.uniform(10, 14), self._draw.uniform(1, 7))
        at = on_map(there, self._origins[self.floor])
        wall = {"start": {"x": at.x, "y": at.y}, "end": {"x": at.x + 1, "y": at.y}}
        assert (await self._client.post(WALLS, json=[wall])).status_code == 200
        self._walls[self.floor].append(there)

    async def origin(self) -> None:
        if self.at_rest:
            new = {"x": self._draw.randint(-40, 40) * 0.05, "y": self._draw.randint(-40, 40) * 0.05}
            reply = await self._client.put(f"{SLAM}/maps/origin", json={"new_origin": new})
            assert reply.status_code == 200, reply.text
            self.witness.note(new)
            self._origins[self.floor] = self._origins[self.floor].compose(Pose(new["x"], new["y"]))

    async def sync(self) -> None:
        reply = await self._client.post(f"{MULTI}/stcm/:sync")
        self.witness.note(reply.status_code, reply.text)

    def _here(self) -> Options:
        here = self.witness.pose.relative_to(self._origins[self.floor])
        return {"x": here.x, "y": here.y, "yaw": here.yaw}

    async def reload(self) -> None:
        """Sync, load, and say floor and place."""
        if self.at_rest:
            await self.sync()
            await self.abort()
            assert (await self._client.post(f"{MULTI}/stcm/:reload")).status_code == 200
            self._walls = [[], []]  # it has those of the file
            await self.enter()

    async def enter(self) -> None:
        if self.at_rest:
            self._origins = [self._saved, self._saved]
            body = {"building": "A", "floor": MAPS[self.floor], "pose": self._here()}
            reply = await self._client.put(f"{MULTI}/floors/:current", json=body)
            assert reply.status_code == 200, reply.text

    async def pose(self) -> None:
        if self.at_rest:
            assert (await self._client.put(f"{SLAM}/localization/pose", json=self._here())).status_code == 200

    async def check(self) -> None:
        for id, floor in list(self._actions.items()):
            info = (await self._client.get(f"{ACTIONS}/{id}")).json()
            state = info["state"]
            if id in self._ended:
                assert info == self._ended[id]
            elif state["status"] == 4:
                self._ended[id] = info
                self.witness.note(id, floor, state)
                assert (state["result"] == 0) == (state["reason"] == ""), state
                assert state["result"] or floor in (None, self.floor)
        entered = (await self._client.get(f"{MULTI}/floors/:current")).json()["floor"]
        if entered != self._entered:
            self._entered, self._origins = entered, [self._saved, self._saved]
        rested, self._rested = self._rested, self.at_rest
        if rested and self._rested:
            await self._check_drawings()

    async def _check_drawings(self) -> None:
        said = (await self._client.get(f"{MULTI}/floors/:current")).json()["floor"]
        assert said == MAPS[self.floor]
        origin = self._origins[self.floor]
        at = (await self._client.get(f"{SLAM}/localization/pose")).json()
        sure = (await self._client.get(f"{SLAM}/localization/quality")).json()
        off = origin.compose(Pose(at["x"], at["y"])).distance_to(self.witness.pose)
        assert off < LOST or sure < 50, f"{off:.2f} m off, quality {sure}"
        lines = sorted((await self._client.get(WALLS)).json(), key=lambda line: line["id"])
        walls = [origin.compose(Pose(line["start"]["x"], line["start"]["y"])).point for line in lines]
        drawn = self._walls[self.floor]
        assert len(walls) == len(drawn), (walls, drawn)
        assert all(a.distance_to(b) < LOST for a, b in zip(walls, drawn, strict=True)), (walls, drawn)


@pytest.mark.parametrize("seed", seeds(0, 2))
async def test_floors_keep_their_drawings(
    seed: int,
    robot: Robot,
    client: httpx.AsyncClient,
    world: World,
    forward: Forward,
    caplog: pytest.LogCaptureFixture,
) -> None:
    draw, origin = random.Random(seed), await map_two_floors(robot, client, world, forward)
    witness = Witness(world, robot, forward)
    walk = FloorWalk(draw, client, witness, origin)
    with witness.writing():
        for _ in range(ROUNDS):
            await walk.step()
            for _ in range(draw.choice(PAUSES)):
                await witness.pass_time(1.0)
                await walk.check()
        await client.delete(f"{ACTIONS}/:current")
        await witness.sees_it_rest(10.0)
        await walk.check()
        assert not [r for r in caplog.records if r.levelname in ("ERROR", "CRITICAL")]
