"""A client that has loaded the map of two of the office's floors, and sends the robot up and down."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import httpx

from roboglot.model.components.mapping.annotations import Annotations, Area, AreaKind
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, FloorName, composite_of
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, encode_stcm

MULTI, ACTIONS = "/api/multi-floor/map/v1", "/api/core/motion/v1/actions"
ELEVATORS = f"{MULTI}/elevators"
AREAS = "/api/core/artifact/v1/rectangle-areas/elevator_area"
LIFT = "9b0c0d6e-0000-4000-8000-000000000001"
SUCCESS = {"status": 4, "result": 0, "reason": ""}
FRONT, BACK = Point(1.75, 10.0), Point(0.15, 10.0)  # of the car, in the world
MAPS = ("ground", "first")  # loaded; the third floor has none


def on_map(point: Point, origin: Pose) -> Point:
    return Pose(point.x, point.y).relative_to(origin).point


def area_of(origin: Pose, doors: str = "0") -> dict[str, Any]:
    start, end = ends_of(origin, doors)
    ends = {"start": {"x": start.x, "y": start.y}, "end": {"x": end.x, "y": end.y}}
    return {"area": {**ends, "half_width": 0.8}, "metadata": metadata_of(doors)}


def ends_of(origin: Pose, doors: str) -> tuple[Point, Point]:
    """Return the ends of the car's area on the map; its only door is where the rear one is if that is all it has."""
    start, end = on_map(FRONT, origin), on_map(BACK, origin)
    return (end, start) if doors == "1" else (start, end)


def metadata_of(doors: str) -> dict[str, str]:
    return {
        "elevator_id": LIFT,
        "elevator_sill_width": "0.3",
        "elevator_scheduling_point_dist": "0.9",
        "elevator_door_type": doors,
    }


async def start(client: httpx.AsyncClient, name: str, **options: object) -> int:
    reply = await client.post(ACTIONS, json={"action_name": f"agent.actions.{name}", "options": options})
    assert reply.status_code == 200, reply.text
    return int(reply.json()["action_id"])


async def finish(
    client: httpx.AsyncClient, forward: Forward, id: int, *, within: float = 300.0
) -> tuple[Any, list[str]]:
    """Return the end of the action, and its stages."""
    stages: list[str] = []
    for _ in range(int(within * 2)):
        info = (await client.get(f"{ACTIONS}/{id}")).json()
        if info["state"]["status"] == 4:
            return info["state"], stages
        if not stages or stages[-1] != info["stage"]:
            stages.append(info["stage"])
        await forward(seconds=0.5)
    raise AssertionError(f"action {id} has not ended within {within} s: {info}")


async def drive_to(client: httpx.AsyncClient, forward: Forward, origin: Pose, *xs: float) -> None:
    """Along the corridor before the lift, to these places in the world one after the other."""
    for x in xs:
        goal = on_map(Point(x, 10.0), origin)
        id = await start(client, "MoveToAction", target={"x": goal.x, "y": goal.y})
        assert (await finish(client, forward, id))[0] == SUCCESS


async def two_floors(robot: Robot, client: httpx.AsyncClient, origin: Pose, doors: str = "0") -> None:
    """A map of two floors of the same building, the upper one known as far as the lower one is."""
    start, end = ends_of(origin, doors)
    drawn = Annotations().with_new(Area(0, AreaKind.ELEVATOR, start, end, 0.8, metadata=metadata_of(doors)))
    grid = robot[Mapping].grid
    up = on_map(Point(6.0, 10.0), origin)
    rooms = (PointOfInterest("u1", Pose(up.x, up.y), {"display_name": "upstairs"}),)
    down = on_map(Point(8.0, 10.0), origin)
    halls = (PointOfInterest("g1", Pose(down.x, down.y), {"display_name": "downstairs"}),)
    dock = PointOfInterest("3fa85f64-5717-4562-b3fc-2c963f66afa6", Pose(), {"display_name": "dock"})
    lower = FloorMap(FloorName("A", "ground", 0, default=True), grid, replace(drawn, docks=(dock,)), halls)
    upper = FloorMap(FloorName("A", "first", 1, default=False), grid, drawn, rooms)
    layers = (*composite_of(lower).layers, *composite_of(upper).layers)
    assert (await client.post(f"{MULTI}/stcm", content=encode_stcm(CompositeMap(layers)))).status_code == 200
    here = robot[Localization].pose
    pose = {"x": here.x, "y": here.y, "yaw": here.yaw}
    assert (await client.post(f"{MULTI}/stcm/:reload", json={"pose": pose})).status_code == 200


async def map_two_floors(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward, doors: str = "0"
) -> Pose:
    """Map the way to the lift, and load that as both floors; return the map's origin in the world."""
    origin = world.truth.pose_of("a")
    world.stage.person("person 0 0").place(28.5, 10.5)  # out of the way
    await forward(seconds=1)
    await drive_to(client, forward, origin, 10.0, 5.0)
    await two_floors(robot, client, origin, doors)
    return origin
