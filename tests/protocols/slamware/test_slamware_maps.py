"""Maps in memory and on disk, docks and floors, through a real socket, judged by the simulated robot."""

from __future__ import annotations

import itertools
import math
import time

import httpx
import pytest

from roboglot.model.components.annotations import MapAnnotations
from roboglot.model.components.docking import Docking
from roboglot.model.components.driving import Driving
from roboglot.model.components.localization import Localization
from roboglot.model.components.mapping import Mapping
from roboglot.model.components.places import Places
from roboglot.model.events import LoopClosed
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.composite import FloorMap, FloorName, composite_of, floors_of
from roboglot.simulation.world import World
from roboglot.testing import Forward
from roboglot.wire.slamware.stcm import CompositeMap, Layer, decode_stcm, encode_stcm

SLAM, ARTIFACT, MULTI = "/api/core/slam/v1", "/api/core/artifact/v1", "/api/multi-floor/map/v1"
STCM = f"{SLAM}/maps/stcm"
DESK = {"id": "d1", "pose": {"x": 1.0, "y": 0.5, "yaw": 0.25}, "metadata": {"display_name": "desk", "type": "ROOM"}}
WALL = {"start": {"x": 0.0, "y": 1.0}, "end": {"x": 2.0, "y": 1.0}, "metadata": {"colour": "red"}}
ICE = {
    "area": {"start": {"x": 0.0, "y": 0.0}, "end": {"x": 4.0, "y": 0.0}, "half_width": 0.5},
    "metadata": {"max_line_speed": "0.2"},
}
STRANGE = Layer((("usage", "dbow"), ("type", "whatever")), bytes(range(256)))


async def ok(reply: httpx.Response) -> httpx.Response:
    assert reply.status_code in (200, 204), reply.text
    return reply


@pytest.fixture
async def drawn(client: httpx.AsyncClient, forward: Forward) -> None:
    """A map with a place, a wall and an area on it."""
    await forward(seconds=1)
    await ok(await client.post(f"{ARTIFACT}/pois", json=DESK))
    await ok(await client.post(f"{ARTIFACT}/lines/walls", json=[WALL]))
    await ok(await client.post(f"{ARTIFACT}/rectangle-areas/dangerous_area", json=ICE))


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


async def test_what_is_no_map_is_refused_and_nothing_changes(
    robot: Robot, client: httpx.AsyncClient, drawn: None
) -> None:
    grid = robot[Mapping].grid
    for nonsense in (b"", b"STCM", b"{}", encode_stcm(CompositeMap((STRANGE,)))):
        assert (await client.put(STCM, content=nonsense)).status_code == 400
    assert (await client.post(f"{MULTI}/stcm", content=b"nonsense")).status_code == 400
    assert robot[Mapping].grid is grid
    assert robot[Places].all()


async def test_memory_and_disk_are_two_things(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    async def status() -> str:
        return str((await client.get("/api/multi-floor/status")).json()["map_load_status"])

    assert await status() == "NOT_LOADED"
    assert (await client.post(f"{MULTI}/stcm/:reload")).status_code == 404
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    assert (await client.get(f"{MULTI}/floors")).json() == []  # saved is not loaded
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
    start = world.pose_of("a")
    robot[Driving].move_by(Pose(1.5))
    await forward(seconds=6)
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    here = robot[Localization].pose
    guess = {"x": here.x + 0.2, "y": here.y - 0.2, "yaw": here.yaw}
    await ok(await client.post(f"{MULTI}/stcm/:reload", json={"pose": guess}))
    await forward(seconds=2)
    believed = start.compose(robot[Localization].pose)
    assert believed.distance_to(world.pose_of("a")) < 0.06


async def test_without_a_pose_a_reload_puts_the_robot_before_its_dock(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    robot[Driving].move_by(Pose(1.5))
    await forward(seconds=6)
    await ok(await client.post(f"{MULTI}/stcm/:reload"))
    pose = robot[Localization].pose
    assert (pose.x, pose.y) == pytest.approx((0.6, 0.0), abs=0.05)


async def test_what_is_drawn_on_a_floor_is_there_when_the_robot_comes_back(
    client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
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
    # A robot that restarts is on the first floor again, and has mixed up neither.
    await ok(await client.post("/api/core/system/v1/power/:restartmodule", json={"mode": "RestartModeSoft"}))
    await forward(seconds=10)
    assert (await client.get(f"{MULTI}/floors/:current")).json()["floor"] == "1F"
    assert await there() == ({"new below"}, 1)
    await go("2F")
    assert await there() == ({"new above"}, 0)
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


async def test_docks(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    docks = f"{SLAM}/homedocks"
    await forward(seconds=1)
    (own,) = (await client.get(docks)).json()
    assert own["metadata"] == {"display_name": "home"}
    second = {"id": "second", "pose": {"x": 3.0, "y": 1.0, "yaw": 0.5}, "metadata": {"display_name": "二"}}
    assert (await client.post(docks, json={**second, "metadata": {}})).status_code == 400  # no name
    assert (await ok(await client.post(docks, json=second))).json() is True
    assert (await client.get(docks)).json() == [own, second]
    assert robot[Docking].home == Pose(own["pose"]["x"], own["pose"]["y"], own["pose"]["yaw"])

    await ok(await client.delete(f"{docks}/{own['id']}"))
    assert robot[Docking].home == Pose(3.0, 1.0, 0.5)
    moved = {"pose": {"x": 4.0, "y": 1.0, "yaw": 0.5}}
    await ok(await client.put(f"{docks}/second", json=moved))
    assert robot[Docking].home == Pose(4.0, 1.0, 0.5)
    assert (await client.put(f"{docks}/nobody", json=moved)).status_code == 404
    await ok(await client.put(f"{SLAM}/homepose", json={"x": 5.0, "y": 1.0, "z": 0, "yaw": 0, "pitch": 0, "roll": 0}))
    assert (await client.get(docks)).json()[0]["pose"]["x"] == 5.0

    assert (await ok(await client.delete(docks))).json()["id"] == "second"
    assert robot[Docking].home is None
    assert (await client.get(docks)).json() == []
    assert (await client.get(f"{SLAM}/homepose")).status_code == 404

    registered = (await ok(await client.post(f"{docks}/:register", json={"metadata": {"display_name": "here"}}))).json()
    home = robot[Docking].home
    assert home is not None
    assert math.hypot(home.x - registered["pose"]["x"], home.y - registered["pose"]["y"]) < 1e-6
    assert home.distance_to(robot[Localization].pose) < 0.01
    assert (await ok(await client.put(docks, json=[second]))).json() is True
    assert robot[Docking].home == Pose(3.0, 1.0, 0.5)


async def test_a_moved_origin_is_forgotten_with_the_map_in_memory(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    """After a restart the grid is the saved one: what is drawn lies on it where it lay."""
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
    """After a restart the saved grid is back, and on it what was drawn on it: nothing of the new map's."""
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
    assert (await client.get(f"{SLAM}/homedocks")).json() == [dock]  # which nobody entered: it woke up there
    assert robot[Docking].home is not None
    assert [place.id for place in robot[Places].all()] == ["d1", "later"]
    assert len((await client.get(f"{ARTIFACT}/lines/walls")).json()) == 1

    await ok(await client.delete(f"{SLAM}/maps"))
    await forward(seconds=1)
    await ok(await client.post(f"{MULTI}/stcm/:save"))  # now the new one is on the disk, and what is drawn is its own
    await ok(await client.post(f"{ARTIFACT}/lines/walls", json=[WALL]))
    await ok(await client.post("/api/core/system/v1/power/:restartmodule", json={"mode": "RestartModeSoft"}))
    await forward(seconds=10)
    assert len((await client.get(f"{ARTIFACT}/lines/walls")).json()) == 2


async def test_the_bound_dock_is_home(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    named = [
        {"id": id, "pose": {"x": x, "y": 0.0, "yaw": 0.0}, "metadata": {"display_name": id}}
        for id, x in (("near", 1.0), ("far", 9.0))
    ]
    await ok(await client.put(f"{SLAM}/homedocks", json=named))
    current = f"{MULTI}/homedocks/:current"
    assert (await client.get(current)).json()["result"] is False
    assert (await client.put(current, json={"dock_id": "far"})).status_code == 404  # not loaded yet
    await ok(await client.post(f"{MULTI}/stcm/:sync"))
    await ok(await client.put(current, json={"dock_id": "far"}))
    assert (await client.get(current)).json()["data"]["dock_name"] == "far"
    assert robot[Docking].home == Pose(9.0)
    assert (await client.post(f"{MULTI}/homedocks/:search_nearby")).json()["id"] == "near"
    assert [dock["id"] for dock in (await client.get(f"{MULTI}/homedocks")).json()] == ["near", "far"]


async def test_the_nearest_place(robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None) -> None:
    nearby = f"{MULTI}/pois/:search_nearby"
    assert (await client.post(nearby)).json()["name"] == "ON_DOCK"
    robot[Driving].move_by(Pose(1.0))
    await forward(seconds=5)
    assert (await client.post(nearby)).json() == {"name": "UNKNOWN"}
    await ok(await client.post(f"{MULTI}/stcm/:sync"))
    found = (await client.post(nearby)).json()
    assert (found["name"], found["id"]) == ("desk", "d1")
    seen = found["relative_pose"]
    assert (seen["x"], seen["y"]) == pytest.approx((0.0, 0.5), abs=0.05)


async def test_a_lost_robot_is_told_where_it_is_by_name(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    pose, dock = "/api/multi-floor/localization/v1/pose", "/api/multi-floor/localization/v1/homedock"
    assert (await client.put(pose, json={"poi_name": "desk"})).status_code == 404  # not loaded yet
    await ok(await client.post(f"{MULTI}/stcm/:sync"))
    assert (await ok(await client.put(pose, json={"poi_name": "desk"}))).json() is True
    assert robot[Localization].pose.distance_to(Pose(1.0, 0.5)) < 0.01
    await ok(await client.put(dock))
    assert robot[Localization].pose.distance_to(Pose(0.6)) < 0.05
    assert (await client.put(dock, json={"dock_id": "nobody"})).status_code == 404


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


@pytest.mark.world("empty")
async def test_places_are_put_in_order_by_the_ways_to_them(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    for name, x, y in (("a", 1.0, 0.0), ("b", 3.0, 0.0), ("c", 2.0, 0.0), ("d", 2.0, 1.0)):
        place = {"id": f"id-{name}", "pose": {"x": x, "y": y, "yaw": 0.0}, "metadata": {"display_name": name}}
        await ok(await client.post(f"{ARTIFACT}/pois", json=place))
    dispatch = f"{MULTI}/pois/:dispatch"
    assert (await client.post(dispatch, json=["a"])).status_code == 404  # not loaded yet
    await ok(await client.post(f"{MULTI}/stcm/:sync"))
    order = (await ok(await client.post(dispatch, json=["b", "d", "a", "c"]))).json()
    assert order in (["a", "c", "b", "d"], ["d", "b", "c", "a"])
    assert (await client.post(dispatch, json=[])).json() == []
    assert sorted((await ok(await client.post(dispatch, json=["a", "b", "a", "c"] * 3))).json()) == sorted("abac" * 3)
    assert (await client.post(dispatch, json=["a"] * 501)).status_code == 400
    far = {"id": "far", "pose": {"x": 400.0, "y": 0.0, "yaw": 0.0}}
    await ok(await client.post(f"{ARTIFACT}/pois", json=far))
    await ok(await client.post(f"{MULTI}/stcm/:sync"))
    assert (await client.post(dispatch, json=["a", "far"])).status_code == 400  # off all that is known


@pytest.mark.world("empty")
async def test_hundreds_of_places_are_put_in_a_good_order_within_a_second(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    spots = {f"p{n}": (1.5 * math.cos(n * 0.7), 1.5 * math.sin(n * 0.7)) for n in range(300)}  # round and round
    await robot[Places].put(*(PointOfInterest(id, Pose(x, y)) for id, (x, y) in spots.items()))
    await ok(await client.post(f"{MULTI}/stcm/:sync"))
    await ok(await client.post(f"{MULTI}/pois/:dispatch", json=list(spots)[:20]))  # the kernels are loaded
    began = time.process_time()
    order = (await ok(await client.post(f"{MULTI}/pois/:dispatch", json=list(spots)))).json()
    assert time.process_time() - began < 1.0
    assert sorted(order) == sorted(spots)
    way = [(0.0, 0.0), *(spots[name] for name in order), (0.0, 0.0)]
    shortest = math.tau * 1.5 + 2 * 1.5
    assert sum(math.dist(a, b) for a, b in itertools.pairwise(way)) < 1.25 * shortest


async def test_loop_closure_is_switched_and_told(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    path = f"{SLAM}/loopclosure/:enable"
    assert (await client.get(path)).json() is robot[Mapping].closes_loops
    for on in (False, True):
        assert (await ok(await client.put(path, json={"enable": on}))).json() is True
        assert robot[Mapping].closes_loops is on
    robot.events.publish(LoopClosed(stamp=1.5, shift=0.1))
    assert {"type": "MAP_LOOP_CLOSURE", "timestamp": "1500"} in (await client.get("/api/platform/v1/events")).json()


async def test_nothing_drawn_gets_too_far_from_the_origin_to_be_saved(
    client: httpx.AsyncClient, forward: Forward
) -> None:
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


async def test_clearing_docks_answers_the_one_that_was_home_or_null(
    client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    docks = "/api/core/slam/v1/homedocks"
    entry = {"id": "d", "pose": {"x": 0.0, "y": 1.0, "yaw": 0.0}, "metadata": {"display_name": "d"}}
    assert (await client.put(docks, json=[entry])).status_code == 200
    assert (await client.delete(docks)).json()["id"] == "d"
    assert (await client.delete(docks)).json() is None
