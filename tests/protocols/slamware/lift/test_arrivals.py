"""The moment in which the lift brings the robot to another floor: its map is in use, its drawings are being stored."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import httpx
import pytest

from roboglot.control.lease_server import LeaseServer, Request
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import MapMemory
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.events import FloorReached
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.slam.last_place import last_place
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.narrowing import known
from tests.protocols.slamware.lift.two_floors import (
    ACTIONS,
    MULTI,
    start,
    two_floors,
)


async def test_questions_on_arrival_wait_for_new_floor(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, origin: Pose, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The drawings of the new floor are being written to disk; a move is planned by them, too."""
    await forward(seconds=1)
    await two_floors(robot, client, origin)
    memory, written = type(robot[MapMemory]), asyncio.Event()
    write = memory.replace

    async def replace_slowly(*arguments: Any) -> None:
        await written.wait()
        await write(*arguments)

    monkeypatch.setattr(memory, "replace", replace_slowly)
    robot.events.publish(FloorReached(stamp=robot.clock.time(), floor=1, place=Pose(0.1)))
    places = client.get("/api/core/artifact/v1/pois")
    asked = [asyncio.ensure_future(asking) for asking in (client.get(f"{MULTI}/floors/:current"), places)]
    way = asyncio.ensure_future(robot[Navigation].plan(Point(0.5), Point(1.0)))
    going = asyncio.ensure_future(start(client, "MultiFloorMoveAction", target={"poi_name": "upstairs"}))
    done, _ = await asyncio.wait([*asked, way, going], timeout=0.05)
    assert not done
    assert (await client.delete(f"{ACTIONS}/:current")).status_code == 200  # no stop waits
    written.set()
    here, places_here = [reply.json() for reply in await asyncio.gather(*asked)]
    assert (here["floor"], [place["id"] for place in places_here]) == ("first", ["u1"])
    await asyncio.gather(way, going)
    await forward(seconds=1)
    assert known(last_place(robot)).floor == here["map_id"]  # for its next start
    assert robot[Floors].current == 1
    assert (await client.get(f"{ACTIONS}/:current")).json()["stage"] == "IN_ELEVATOR"  # and out of it, here


async def test_reset_robot_uses_start_floors_map(
    world: World, robot: Robot, client: httpx.AsyncClient, forward: Forward, origin: Pose, tmp_path: Path
) -> None:
    await forward(seconds=1)
    await two_floors(robot, client, origin)
    robot.events.publish(FloorReached(stamp=robot.clock.time(), floor=1, place=Pose(0.1)))
    assert (await client.get(f"{MULTI}/floors/:current")).json()["floor"] == "first"
    await LeaseServer(tmp_path, world.robots, world.stage).do(Request("reset", "a"), robot)
    assert (await client.get(f"{MULTI}/floors/:current")).json()["floor"] == "ground"
    assert [place["id"] for place in (await client.get("/api/core/artifact/v1/pois")).json()] == ["g1"]
    assert robot[Floors].current == 0
    await forward(seconds=3)
    assert robot[Localization].lost is None
    assert robot[Localization].pose.distance_to(Pose()) < 0.05  # on its dock
