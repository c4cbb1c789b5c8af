"""Rides that are given up at any moment: the map in use is that of the floor where the robot is."""

from __future__ import annotations

import math
import random
from typing import Any

import httpx
import pytest

from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.protocols.slamware.lift.two_floors import (
    ACTIONS,
    MAPS,
    MULTI,
    SUCCESS,
    finish,
    map_two_floors,
    on_map,
    start,
)
from tests.protocols.witness import Witness


class RideWalk:
    """A client that sends the robot up and down, and thinks better of it at any moment."""

    def __init__(self, draw: random.Random, client: httpx.AsyncClient, witness: Witness, origin: Pose) -> None:
        self._draw, self._client, self._witness, self._origin = draw, client, witness, origin
        self._floors: dict[int, int | None] = {}  # by action: the floor where it ends, if it says
        self._stopped = self._broken = self._rested = False

    async def step(self) -> None:
        kind = self._draw.random()
        if self._stopped or kind < 0.1:
            self._stopped = not self._stopped
            value = {"param": "base.emergency_stop", "value": "on" if self._stopped else "off"}
            assert (await self._client.put("/api/core/system/v1/parameter", json=value)).status_code == 200
            self._witness.stopped_at = self._witness.now if self._stopped else math.inf
        elif kind < 0.25:
            assert (await self._client.delete(f"{ACTIONS}/:current")).status_code == 200
        elif self._broken or kind < 0.35:
            self._broken = not self._broken
            faults = self._witness.world.faults
            if self._broken:
                faults.inject("lift_out_of_service")
            else:
                faults.clear()
        elif kind < 0.45:
            self._witness.robot[LiftClient].call(self._draw.randint(0, 2))
        else:
            await self._go()
        self._witness.note(kind, self._stopped, self._broken, self._witness.world.truth.floor_of("a"))

    async def _go(self) -> None:
        goal = on_map(Point(self._draw.uniform(4.0, 8.0), 10.0), self._origin)
        kinds: list[tuple[str, dict[str, Any], int | None]] = [
            ("MultiFloorMoveAction", {"target": {"poi_name": "upstairs"}}, 1),
            ("MultiFloorMoveAction", {"target": {"poi_name": "downstairs"}}, 0),
            ("MoveToAction", {"target": {"x": goal.x, "y": goal.y}}, None),
        ]
        name, options, floor = self._draw.choice(kinds)
        self._floors[await start(self._client, name, **options)] = floor

    async def check(self) -> None:
        """Assert that an action that succeeded is on its floor, and that the door knows the floor."""
        for id, floor in list(self._floors.items()):
            state = (await self._client.get(f"{ACTIONS}/{id}")).json()["state"]
            if state["status"] == 4:
                del self._floors[id]
                self._witness.note(id, floor, state)
                assert state["result"] or floor in (None, self._witness.world.truth.floor_of("a"))
        lift, rested = self._witness.world.building.lift, self._rested
        self._rested = lift is not None and lift.rests
        if rested and self._rested and not self._witness.running:
            said = (await self._client.get(f"{MULTI}/floors/:current")).json()["floor"]
            floor = self._witness.world.truth.floor_of("a")
            assert floor >= len(MAPS) or said == MAPS[floor]


@pytest.mark.slow  # rides take minutes of robot time; in short: test_ride_given_up_in_the_car
@pytest.mark.parametrize("seed", range(8))
async def test_rides_given_up_at_any_moment(
    seed: int, robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    draw, origin = random.Random(seed), await map_two_floors(robot, client, world, forward)
    witness = Witness(world, robot, forward)
    walk = RideWalk(draw, client, witness, origin)
    with witness.writing():
        for _ in range(20):
            await walk.step()
            for _ in range(draw.choice([1, 2, 5, 20, 60])):
                await witness.pass_time(1.0)
                await walk.check()
        await client.delete(f"{ACTIONS}/:current")
        await witness.sees_it_rest(10.0)
        await walk.check()


@pytest.mark.slow  # in short: test_ride_given_up_in_the_car
@pytest.mark.parametrize("how", ["action", "order"])
async def test_car_of_given_up_ride_is_left(
    how: str, robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    origin = await map_two_floors(robot, client, world, forward)
    ride = await start(client, "MultiFloorMoveAction", target={"poi_name": "upstairs"})
    while world.truth.pose_of("a").distance_to(Point(0.95, 10.0)) > 0.1:
        await forward(seconds=0.5)
    await forward(seconds=2)
    await client.delete(f"{ACTIONS}/:current")
    await finish(client, forward, ride)
    await forward(seconds=30)
    assert (world.truth.floor_of("a"), robot[LiftClient].state.target) == (1, None)
    if how == "action":
        again = await start(client, "MultiFloorMoveAction", target={"poi_name": "upstairs"})
        assert (await finish(client, forward, again))[0] == SUCCESS
    else:
        tasks, order = "/api/delivery/v1/tasks", {"location": {"poi_name": "upstairs", "task_points": []}}
        assert (await client.post(tasks, json=order | {"type": "RETURN"})).json()["result"] is True
        status = ""
        while status not in ("SUCCEEDED", "FAILED"):
            await forward(seconds=1)
            (task,) = (await client.get(tasks, params={"status": "all"})).json()
            status = task["status"]
        assert status == "SUCCEEDED", task
    assert world.truth.floor_of("a") == 1
    assert world.truth.pose_of("a").point.distance_to(Point(6.0, 10.0)) < 0.3
    assert robot[Localization].pose.distance_to(on_map(Point(6.0, 10.0), origin)) < 0.3
