"""Maps in memory and on disk, and floors, through a real socket, judged by the simulated robot."""

from __future__ import annotations

import math
from dataclasses import replace

import httpx
import numpy as np
import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.mapping.annotations import LineKind, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.events import LoopClosed
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.slam.composite import (
    FloorMap,
    FloorName,
    composite_of,
    floors_of,
)
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from roboglot.wire.slamware.chapters.slam import stcm_layers
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, Layer, decode_stcm, encode_stcm
from tests.protocols.slamware.drawings import DESK, WALL, ok

SLAM, ARTIFACT, MULTI = "/api/core/slam/v1", "/api/core/artifact/v1", "/api/multi-floor/map/v1"
STCM = f"{SLAM}/maps/stcm"
STRANGE = Layer((("usage", "dbow"), ("type", "whatever")), bytes(range(256)))


async def test_a_composite_map_brings_everything_back(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    assert robot[Mapping].grid.width > 50
    data = (await ok(await client.get(STCM))).content
    composite = decode_stcm(data)
    assert [layer.metadata["usage"] for layer in composite.layers] == [
        "explore", "virtual_walls", "point_of_interest", "home_dock_pose", "rectangle_area"
    ]  # fmt: skip
    with_strange = encode_stcm(CompositeMap((STRANGE, *composite.layers)))
    for path in (
        f"{ARTIFACT}/pois",
        f"{ARTIFACT}/lines/walls",
        f"{SLAM}/maps",
        f"{ARTIFACT}/rectangle-areas/dangerous_area",
    ):
        await ok(await client.delete(path))
    grid = floors_of(composite)[0].grid
    assert grid is not None

    await ok(await client.put(STCM, content=with_strange))
    assert (robot[Mapping].grid.log_odds == grid.log_odds).all()
    assert robot[Localization].pose == Pose()
    assert (await client.get(f"{ARTIFACT}/pois")).json() == [DESK]
    (wall,) = (await client.get(f"{ARTIFACT}/lines/walls")).json()
    assert {**wall, "id": 0} == {**WALL, "id": 0}
    (ice,) = robot[MapAnnotations].current.areas
    assert ice.speed_max == 0.2
    assert robot[Docking].home is not None
    again = decode_stcm((await ok(await client.get(STCM))).content)
    assert STRANGE in again.layers
    types = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
    assert "SET_MAP_DONE" in types


async def test_invalid_map_is_refused_and_nothing_changes(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    grid = robot[Mapping].grid
    for nonsense in (b"", b"STCM", b"{}", encode_stcm(CompositeMap((STRANGE,)))):
        assert (await client.put(STCM, content=nonsense)).status_code == 400
    assert (await client.post(f"{MULTI}/stcm", content=b"nonsense")).status_code == 400
    assert robot[Mapping].grid is grid
    assert robot[Places].all()


async def test_refused_maps_stop_nothing(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    """The robot was stopped first, and then it turned out that there was no such map."""
    drive = robot[Driving].drive(Twist(0.1), source="test")
    await forward(seconds=1)
    assert (await client.post(f"{MULTI}/stcm/:reload")).status_code == 404
    floor = {"building": "", "floor": "9F"}
    assert (await client.put(f"{MULTI}/floors/:current", json=floor)).status_code == 404
    assert (await client.put(STCM, content=b"nonsense")).status_code == 400
    await forward(seconds=1)
    assert drive.status is ActionStatus.EXECUTING


async def test_memory_and_disk_are_two_things(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    async def status() -> str:
        return str((await client.get("/api/multi-floor/status")).json()["map_load_status"])

    assert await status() == "NOT_LOADED"
    assert (await client.post(f"{MULTI}/stcm/:reload")).status_code == 404
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    assert (await client.get(f"{MULTI}/floors")).json() == []  # saved does not mean loaded
    await ok(await client.delete(f"{ARTIFACT}/pois"))
    await ok(await client.delete(f"{ARTIFACT}/lines/walls"))
    await ok(await client.post(f"{MULTI}/stcm/:reload"))
    assert await status() == "LOADED"
    assert [place.id for place in robot[Places].all()] == ["d1"]
    assert len(robot[MapAnnotations].current.lines) == 1
    assert (await client.get(f"{MULTI}/floors")).json() == [
        {"building": "", "floor": "1F", "order": 0, "is_default_floor": True}
    ]
    floor = (await client.get(f"{MULTI}/floors/:current")).json()
    assert (floor["floor"], floor["elevator"]) == ("1F", "")

    await ok(await client.post(f"{ARTIFACT}/pois", json={**DESK, "id": "d2", "metadata": {"display_name": "door"}}))
    pois = f"{MULTI}/pois"
    assert [poi["poi_name"] for poi in (await client.get(pois)).json()] == ["desk"]
    await ok(await client.post(f"{MULTI}/stcm/:sync"))
    assert (await client.get(pois, params={"floor": "1F"})).json() == [
        {"id": "d1", "poi_name": "desk", "floor": "1F", "building": "", "pose": DESK["pose"], "type": "ROOM"},
        {"id": "d2", "poi_name": "door", "floor": "1F", "building": "", "pose": DESK["pose"]},
    ]
    assert (await client.get(pois, params={"floor": "9F"})).status_code == 400

    grid = robot[Mapping].grid
    deleted = await client.delete(f"{MULTI}/stcm")
    assert (deleted.status_code, deleted.content) == (204, b"")
    assert robot[Mapping].grid is grid
    assert (await client.post(f"{MULTI}/stcm/:reload")).status_code == 404


async def test_a_reloaded_map_is_the_same_place(
    robot: Robot, world: World, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    start = world.truth.pose_of("a")
    robot[Driving].move_by(Pose(1.5))
    await forward(seconds=6)
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    here = robot[Localization].pose
    guess = {"x": here.x + 0.2, "y": here.y - 0.2, "yaw": here.yaw}
    await ok(await client.post(f"{MULTI}/stcm/:reload", json={"pose": guess}))
    await forward(seconds=2)
    believed = start.compose(robot[Localization].pose)
    assert believed.distance_to(world.truth.pose_of("a")) < 0.06


async def test_without_pose_reload_puts_robot_before_its_dock(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    robot[Driving].move_by(Pose(1.5))
    await forward(seconds=6)
    await ok(await client.post(f"{MULTI}/stcm/:reload"))
    pose = robot[Localization].pose
    assert (pose.x, pose.y) == pytest.approx((0.6, 0.0), abs=0.05)


async def test_drawing_on_a_floor_survives_leaving_it(client: httpx.AsyncClient, forward: Forward, drawn: None) -> None:
    lower = floors_of(decode_stcm((await ok(await client.get(STCM))).content))[0]
    upper = FloorMap(FloorName("", "2F", 1, default=False), lower.grid)
    layers = (*composite_of(lower).layers, *composite_of(upper).layers)
    await ok(await client.post(f"{MULTI}/stcm", content=encode_stcm(CompositeMap(layers))))
    await ok(await client.post(f"{MULTI}/stcm/:reload"))

    async def go(floor: str) -> None:
        await ok(await client.put(f"{MULTI}/floors/:current", json={"floor": floor}))

    async def there() -> tuple[set[str], int]:
        places = (await client.get(f"{ARTIFACT}/pois")).json()
        return {place["id"] for place in places}, len((await client.get(f"{ARTIFACT}/lines/walls")).json())

    assert await there() == ({"d1"}, 1)
    await ok(await client.post(f"{ARTIFACT}/pois", json={**DESK, "id": "new below"}))
    await ok(await client.delete(f"{ARTIFACT}/pois/d1"))
    await go("2F")
    assert await there() == (set(), 0)
    await ok(await client.post(f"{ARTIFACT}/pois", json={**DESK, "id": "new above"}))
    await go("1F")
    assert await there() == ({"new below"}, 1)
    await go("2F")
    assert await there() == ({"new above"}, 0)
    # A restarted robot is where it was, and has confused neither.
    await ok(await client.post("/api/core/system/v1/power/:restartmodule", json={"mode": "RestartModeSoft"}))
    await forward(seconds=10)
    assert (await client.get(f"{MULTI}/floors/:current")).json()["floor"] == "2F"
    assert await there() == ({"new above"}, 0)
    await go("1F")
    assert await there() == ({"new below"}, 1)
    await ok(await client.post(f"{MULTI}/stcm/:reload"))  # the file's own
    assert await there() == ({"d1"}, 1)
    await go("2F")
    assert await there() == (set(), 0)


async def test_several_floors(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    grid = robot[Mapping].grid
    upper = FloorMap(FloorName("A", "2F", 2, default=False), grid.window(-1, -1, 1, 1))
    lower = FloorMap(FloorName("A", "1F", 1, default=True), grid)
    layers = (*composite_of(upper).layers, *composite_of(lower).layers)
    await ok(await client.post(f"{MULTI}/stcm", content=encode_stcm(CompositeMap(layers))))
    assert robot[Mapping].grid is grid
    await ok(await client.post(f"{MULTI}/stcm/:reload"))
    assert [floor["floor"] for floor in (await client.get(f"{MULTI}/floors")).json()] == ["1F", "2F"]
    assert (await client.post(f"{MULTI}/stcm/:save")).status_code == 403
    assert (await client.post(f"{MULTI}/stcm/:sync")).status_code == 403
    change = {"building": "A", "floor": "2F", "pose": {"x": 0.5, "y": 0.25, "yaw": 0}}
    await ok(await client.put(f"{MULTI}/floors/:current", json=change))
    assert (await client.get(f"{MULTI}/floors/:current")).json()["floor"] == "2F"
    assert robot[Mapping].grid.width <= 40
    assert robot[Localization].pose.x == pytest.approx(0.5)
    assert (await client.put(f"{MULTI}/floors/:current", json={"floor": "7F"})).status_code == 404
    assert (await client.delete(f"{MULTI}/stcm")).status_code == 204
    await ok(await client.post(f"{MULTI}/stcm/:save"))  # every floor on disk is kept


async def test_file_that_no_start_could_load_is_refused(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    walls = stcm_layers.line_layer(stcm_layers.WALLS, [stcm_layers.LineEntry("1", 0, 0, 1, 0)])
    refused = await client.post(f"{MULTI}/stcm", content=encode_stcm(CompositeMap((walls,))))
    assert (refused.status_code, "the map has no grid" in refused.text) == (400, True)
    await ok(await client.post(f"{MULTI}/stcm/:reload", json={}))  # the one before is still there
    assert robot[Mapping].grid.width > 0


async def test_the_origin_moves_with_all_that_is_drawn(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    before = robot[Mapping].grid
    await ok(await client.put(f"{SLAM}/maps/origin", json={"new_origin": {"x": 1.01, "y": -0.52}}))
    after = robot[Mapping].grid
    assert (after.origin.x, after.origin.y) == pytest.approx((before.origin.x - 1.0, before.origin.y + 0.5))
    (place,) = robot[Places].all()
    assert (place.pose.x, place.pose.y) == pytest.approx((0.0, 1.0))
    (wall,) = robot[MapAnnotations].current.lines
    assert (wall.end.x, wall.end.y) == pytest.approx((1.0, 1.5))
    assert robot[Localization].pose.x == pytest.approx(-1.0, abs=0.02)
    home = robot[Docking].home
    assert home is not None
    assert home.x == pytest.approx(-1.0)


CURVE = {
    "id": 0,
    "start": {"x": 0.0, "y": 0.0},
    "end": {"x": 3.0, "y": 0.0},
    "metadata": {"control_point1": "{'x':1,'y':1}", "control_point2": "{'x':2,'y':1}"},
}


async def test_drawings_stay_where_a_cleared_map_was(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    """The robot's pose becomes the origin, so the numbers of all that is drawn change."""
    await ok(await client.post(f"{ARTIFACT}/lines/tracks", json=[CURVE]))
    robot[Localization].set_pose(Pose(2.0, 1.0, math.pi / 2))
    origin = Pose(2.0, 1.0, math.pi / 2)
    (wall,), (desk,) = robot[MapAnnotations].current.lines_of(LineKind.WALL), robot[Places].all()
    await ok(await client.delete(f"{SLAM}/maps"))
    (moved,) = robot[MapAnnotations].current.lines_of(LineKind.WALL)
    for before, after in ((wall.start, moved.start), (wall.end, moved.end)):
        expected = Pose(before.x, before.y).relative_to(origin)
        assert (after.x, after.y) == pytest.approx((expected.x, expected.y), abs=1e-6)
    (place,) = robot[Places].all()
    expected = desk.pose.relative_to(origin)
    assert (place.pose.x, place.pose.y, place.pose.yaw) == pytest.approx((expected.x, expected.y, expected.yaw))
    (track,) = (await client.get(f"{ARTIFACT}/lines/tracks")).json()
    assert track["metadata"]["control_point1"] == "{'x':0.0,'y':1.0}"  # was 1, 1
    assert (track["start"]["x"], track["start"]["y"]) == pytest.approx((-1.0, 2.0))


async def test_origin_of_an_empty_map_moves_once(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    """No scan has come since the map was cleared."""
    await ok(await client.delete(f"{SLAM}/maps"))
    (before,) = robot[MapAnnotations].current.lines
    await ok(await client.put(f"{SLAM}/maps/origin", json={"new_origin": {"x": 1.0, "y": -0.5}}))
    assert robot[Mapping].grid.width == 0
    await forward(seconds=0.1)
    (after,) = robot[MapAnnotations].current.lines
    assert (after.end.x, after.end.y) == pytest.approx((before.end.x - 1.0, before.end.y + 0.5))


async def test_moved_origin_is_forgotten_with_map_in_memory(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    """After a restart the grid is the saved one, and drawings lie where they lay."""
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    await ok(await client.put(f"{SLAM}/maps/origin", json={"new_origin": {"x": 1.0, "y": -0.5}}))
    await ok(await client.post(f"{ARTIFACT}/pois", json={**DESK, "id": "later"}))
    await ok(await client.post("/api/core/system/v1/power/:restartmodule", json={"mode": "RestartModeSoft"}))
    await forward(seconds=10)
    desk, later = robot[Places].all()
    assert (desk.pose.x, desk.pose.y) == pytest.approx((1.0, 0.5))
    assert (later.pose.x, later.pose.y) == pytest.approx((2.0, 0.0))
    (wall,) = robot[MapAnnotations].current.lines
    assert (wall.end.x, wall.end.y) == pytest.approx((2.0, 1.0))


async def test_a_cleared_map_is_forgotten_in_memory_only(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    """After a restart the saved grid is back with its own drawings, and none of the new map's."""
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    (dock,) = (await client.get(f"{SLAM}/homedocks")).json()
    saved = robot[Mapping].grid.log_odds.shape
    await ok(await client.post(f"{ARTIFACT}/pois", json={**DESK, "id": "later"}))
    robot[Localization].set_pose(Pose(2.0, 1.0, 1.0))  # the docks' numbers change with the origin
    await ok(await client.delete(f"{SLAM}/maps"))
    (moved,) = (await client.get(f"{SLAM}/homedocks")).json()
    assert moved["pose"] != dock["pose"]
    await ok(await client.post(f"{ARTIFACT}/lines/walls", json=[WALL, WALL]))
    await ok(await client.post("/api/core/system/v1/power/:restartmodule", json={"mode": "RestartModeSoft"}))
    await forward(seconds=10)
    assert robot[Mapping].grid.log_odds.shape == saved
    assert (await client.get(f"{SLAM}/homedocks")).json() == [dock]  # which no one entered: it woke up there
    assert robot[Docking].home is not None
    assert [place.id for place in robot[Places].all()] == ["d1", "later"]
    assert len((await client.get(f"{ARTIFACT}/lines/walls")).json()) == 1

    await ok(await client.delete(f"{SLAM}/maps"))
    await forward(seconds=1)
    await ok(await client.post(f"{MULTI}/stcm/:save"))  # now the new one is on disk, with its own drawings
    await ok(await client.post(f"{ARTIFACT}/lines/walls", json=[WALL]))
    await ok(await client.post("/api/core/system/v1/power/:restartmodule", json={"mode": "RestartModeSoft"}))
    await forward(seconds=10)
    assert len((await client.get(f"{ARTIFACT}/lines/walls")).json()) == 2


@pytest.mark.slow
async def test_a_restart_loses_what_memory_alone_holds(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    """A new map begins where the robot is, unless one is on disk; drawings stay where they are."""
    grid, places = robot[Mapping].grid, robot[Places].all()
    larger = np.pad(grid.log_odds, ((0, 0), (0, 300)), constant_values=-100)
    robot[Mapping].load(replace(grid, log_odds=larger), robot[Localization].pose)
    assert robot[Mapping].grid.width == grid.width + 300
    await ok(await client.put(f"{SLAM}/homepose", json={"x": 1, "y": 2, "z": 0, "yaw": 0, "pitch": 0, "roll": 0}))
    robot[Firmware].reboot()
    await forward(seconds=40)
    home = (await client.get(f"{SLAM}/homepose")).json()
    assert (home["x"], home["y"]) == pytest.approx((1.0, 2.0), abs=0.05)
    assert robot[Mapping].grid.width < grid.width + 300
    assert robot[Places].get("d1").pose.distance_to(places[0].pose) < 0.05

    await ok(await client.post(f"{MULTI}/stcm/:save"))
    await ok(await client.post(f"{ARTIFACT}/lines/walls", json=[WALL]))
    walls, places = (await client.get(f"{ARTIFACT}/lines/walls")).json(), robot[Places].all()
    robot[Firmware].reboot()
    await forward(seconds=40)
    assert (await client.get(f"{ARTIFACT}/lines/walls")).json() == walls
    assert robot[Places].all() == places


async def test_landmarks_are_kept(client: httpx.AsyncClient) -> None:
    path = f"{ARTIFACT}/laser-landmarks"
    marks = [{"id": str(n), "pose": {"x": 1.0, "y": float(n), "yaw": 0.0}, "metadata": {}} for n in range(3)]
    await ok(await client.put(path, json=marks))
    assert (await client.get(path)).json() == marks
    await ok(await client.post(f"{path}/:remove", json=[0, "2"]))
    assert (await client.get(path)).json() == marks[1:2]
    assert (await client.post(f"{path}/:remove", json=[5])).status_code == 404
    await ok(await client.delete(path))
    assert (await client.get(path)).json() == []


async def test_loop_closure_is_switched_and_reported(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    path = f"{SLAM}/loopclosure/:enable"
    assert (await client.get(path)).json() is robot[Mapping].closes_loops
    for on in (False, True):
        assert (await ok(await client.put(path, json={"enable": on}))).json() is True
        assert robot[Mapping].closes_loops is on
    robot.events.publish(LoopClosed(stamp=1.5, shift=0.1))
    assert {"type": "MAP_LOOP_CLOSURE", "timestamp": "1500"} in (await client.get("/api/platform/v1/events")).json()


async def test_drawing_stays_close_enough_to_be_saved(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    far = {"id": "far", "pose": {"x": 95_000.0, "y": 0.0, "yaw": 0.0}}
    assert (await client.post("/api/core/artifact/v1/pois", json=far)).status_code == 200
    origin = "/api/core/slam/v1/maps/origin"
    assert (await client.put(origin, json={"new_origin": {"x": -9000.0, "y": 0.0}})).status_code == 400
    assert (await client.put(origin, json={"new_origin": {"x": -1000.0, "y": 0.0}})).status_code == 200
    assert (await client.get("/api/core/artifact/v1/pois/far")).json()["pose"]["x"] == 96_000.0
    dock = {"id": "d", "pose": {"x": 0.0, "y": 95_000.0, "yaw": 0.0}, "metadata": {"display_name": "d"}}
    assert (await client.post("/api/core/slam/v1/homedocks", json=dock)).status_code == 200
    here = {"x": 0.0, "y": -9_000.0}
    assert (await client.put("/api/core/slam/v1/localization/pose", json=here)).status_code == 200
    assert (await client.delete("/api/core/slam/v1/maps")).status_code == 400
