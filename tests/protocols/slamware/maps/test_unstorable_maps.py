"""Maps whose drawings cannot be stored: refused, and then neither grid nor drawings change."""

from __future__ import annotations

from dataclasses import replace

import httpx
import numpy as np
import pytest

from roboglot.console.verbs.maps import clear_map
from roboglot.model.components.mapping.annotations import LINES_MAX, Annotations, Line, LineKind, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, FloorName, composite_of
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, encode_stcm
from tests.protocols.slamware.drawings import DESK, ICE, ok
from tests.protocols.slamware.drawings import WALL as WIRE_WALL

SLAM, MULTI = "/api/core/slam/v1", "/api/multi-floor/map/v1/stcm"
WALL = Line(1, LineKind.WALL, Point(1.0, 1.0), Point(2.0, 1.0))


@pytest.mark.world("empty")
async def test_full_disk_leaves_grid_and_drawings(
    world: World, robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    """The grid was exchanged, cleared or moved, and the drawings stayed: walls stood elsewhere in the world."""
    await forward(seconds=2)
    await robot[MapAnnotations].change(lambda now: now.with_new(WALL))
    assert (await client.post(f"{MULTI}/:save")).status_code == 200
    data = (await client.get(f"{SLAM}/maps/stcm")).content
    robot[Mapping].enable(False)
    (fault,) = world.faults.inject("full_disk", "a")
    grid, drawn, pose = robot[Mapping].grid, robot[MapAnnotations].current, robot[Localization].pose
    for reply in (
        await client.put(f"{SLAM}/maps/stcm", content=data),
        await client.put(f"{SLAM}/maps/origin", json={"new_origin": {"x": 1.0, "y": 0.0}}),
        await client.delete(f"{SLAM}/maps"),
        await client.post(f"{MULTI}/:reload"),
    ):
        assert (reply.status_code, reply.text) == (403, "operation fail: the disk is full")
    with pytest.raises(Refused, match="disk is full"):
        await clear_map(robot)
    assert (robot[Mapping].grid, robot[MapAnnotations].current, robot[Localization].pose) == (grid, drawn, pose)
    world.faults.clear(fault.number)
    assert (await client.put(f"{SLAM}/maps/origin", json={"new_origin": {"x": 1.0, "y": 0.0}})).status_code == 200
    assert robot[MapAnnotations].current.lines[0].start.x == pytest.approx(0.0)


@pytest.mark.world("empty")
async def test_full_disk_lets_drawings_be_deleted(world: World, robot: Robot, client: httpx.AsyncClient) -> None:
    artifact = "/api/core/artifact/v1"
    walls, areas, pois = (f"{artifact}/{name}" for name in ("lines/walls", "rectangle-areas/dangerous_area", "pois"))
    for number in range(3):
        await ok(await client.post(walls, json=[WIRE_WALL]))
        await ok(await client.post(areas, json=ICE))
        await ok(await client.post(pois, json=DESK | {"id": f"d{number}"}))
    world.faults.inject("full_disk", "a")
    for path in (walls, areas, pois):
        first = (await client.get(path)).json()[0]["id"]
        await ok(await client.delete(f"{path}/{first}"))
        assert len((await client.get(path)).json()) == 2
        await ok(await client.delete(path))
        assert (await client.get(path)).json() == []
    for path, body in ((walls, [WIRE_WALL]), (areas, ICE), (pois, DESK)):
        assert (await client.post(path, json=body)).status_code == 403


async def test_floor_with_too_many_lines_is_refused(bare: Robot, bare_client: httpx.AsyncClient) -> None:
    """The file was stored, and no reload could use that floor."""
    lines = tuple(replace(WALL, id=number) for number in range(1, LINES_MAX + 2))
    grid = OccupancyGrid(np.zeros((4, 4), np.int8), 0.05, Point(0.0, 0.0))
    floors = [
        FloorMap(FloorName("A", "1", 1, True), grid),
        FloorMap(FloorName("A", "2", 2), grid, Annotations(lines=lines)),
    ]
    whole = encode_stcm(CompositeMap(tuple(layer for floor in floors for layer in composite_of(floor).layers)))
    reply = await bare_client.post(MULTI, content=whole)
    assert (reply.status_code, reply.text) == (400, f"Bad Request: more than {LINES_MAX} lines")


def test_too_many_stored_lines_may_become_fewer() -> None:
    """Those of older versions had no limit."""
    stored = Annotations(lines=(WALL,) * (LINES_MAX + 2))
    replace(stored, lines=stored.lines[1:]).check_limits(stored)
    with pytest.raises(InvalidGoal, match="more than"):
        stored.with_new(WALL).check_limits(stored)
