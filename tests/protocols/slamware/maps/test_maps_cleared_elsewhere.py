"""Maps that others clear, with this door open or closed: what is drawn stays where it is in the world."""

from __future__ import annotations

import math
from typing import Any

import httpx
import pytest

from roboglot.model.components.mapping.annotations import LineKind, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import MapMemory
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.slam.composite import (
    floors_of,
)
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.testing import Forward
from roboglot.wire.slamware.chapters.slam.stcm import decode_stcm
from tests.protocols.slamware.conftest import serve
from tests.protocols.slamware.drawings import ok
from tests.protocols.slamware.maps.test_maps import ARTIFACT, CURVE, MULTI, SLAM, STCM


async def test_drawings_stay_where_another_door_clears_map(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    """The console and a dog's mapping clear the same map; after a restart the saved one has its own drawings."""
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    saved = (await client.get(f"{ARTIFACT}/lines/walls")).json()
    origin = Pose(2.0, 1.0, math.pi / 2)
    for _ in range(2):
        robot[Localization].set_pose(origin)
        robot[Mapping].clear()
    await forward(seconds=0.1)
    (moved,) = robot[MapAnnotations].current.lines_of(LineKind.WALL)
    expected = Pose(2.0, 1.0).relative_to(origin).relative_to(origin)
    assert (moved.end.x, moved.end.y) == pytest.approx((expected.x, expected.y), abs=1e-6)
    await ok(await client.post("/api/core/system/v1/power/:restartmodule", json={"mode": "RestartModeSoft"}))
    await forward(seconds=10)
    assert (await client.get(f"{ARTIFACT}/lines/walls")).json() == saved


async def test_drawings_stay_where_closed_door_missed_clearing(
    robot: Robot, door: SlamwareDoor, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    """The console clears the map while this door is closed; opened again, it loads the saved map with its drawings."""
    await ok(await client.put(f"{SLAM}/maps/origin", json={"new_origin": {"x": 1.0, "y": -0.5}}))
    control = {"control_point1": "{'x':1.0,'y':1.0}", "control_point2": "{'x':2.0,'y':1.0}"}
    await ok(await client.post(f"{ARTIFACT}/lines/tracks", json=[CURVE | {"metadata": control}]))
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    asked = [f"{ARTIFACT}/lines/walls", f"{ARTIFACT}/lines/tracks", f"{ARTIFACT}/pois"]
    before = [(await client.get(path)).json() for path in asked]
    await door.close()
    origin = Pose(2.0, 1.0, math.pi / 2)
    (desk,), (wall,) = robot[Places].all(), robot[MapAnnotations].current.lines_of(LineKind.WALL)
    robot[Localization].set_pose(origin)
    robot[Mapping].clear()
    await robot[MapMemory].settle()
    (place,), (moved,) = robot[Places].all(), robot[MapAnnotations].current.lines_of(LineKind.WALL)
    assert place.pose == desk.pose.relative_to(origin)
    assert moved.end == Pose(wall.end.x, wall.end.y).relative_to(origin).point
    async for opened in serve(robot):
        async with httpx.AsyncClient(base_url=opened.endpoints[0].address, timeout=60, verify=False) as again:
            after = [(await again.get(path)).json() for path in asked]
            assert rounded(after) == rounded(before)


async def test_curve_moved_by_others_is_shown_there(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    await ok(await client.post(f"{ARTIFACT}/lines/tracks", json=[CURVE]))
    await robot[MapMemory].move(Pose(1.0, 0.0))
    (track,) = (await client.get(f"{ARTIFACT}/lines/tracks")).json()
    assert track["metadata"] == {"control_point1": "{'x':0.0,'y':1.0}", "control_point2": "{'x':1.0,'y':1.0}"}
    (floor,) = floors_of(decode_stcm((await ok(await client.get(STCM))).content))
    (line,) = floor.annotations.lines_of(LineKind.TRACK)
    assert line.control == (Point(0.0, 1.0), Point(1.0, 1.0))


def rounded(value: Any) -> Any:
    """Return the numbers in ``value`` to a millimetre, as they come back from a turned map."""
    match value:
        case dict():
            return {key: rounded(inner) for key, inner in value.items()}
        case list():
            return [rounded(inner) for inner in value]
        case float():
            return round(value, 3) + 0.0
    return value
