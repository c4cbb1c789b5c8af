"""The docks of the map and the one that is home, through a real socket."""

from __future__ import annotations

import math
from dataclasses import replace

import httpx
import pytest

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.storeys import Storeys
from roboglot.model.components.motion.docking import Docking
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, FloorName, composite_of
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, encode_stcm
from tests.protocols.slamware.drawings import ok

SLAM, MULTI = "/api/core/slam/v1", "/api/multi-floor/map/v1"


async def test_home_that_cannot_be_stored_is_none(robot: Robot, world: World, client: httpx.AsyncClient) -> None:
    home = {"x": 5.0, "y": 1.0, "yaw": 0.5}
    await ok(await client.delete(f"{SLAM}/homedocks"))
    (fault,) = world.faults.inject("full_disk", "a")
    assert (await client.put(f"{SLAM}/homepose", json=home)).status_code == 403
    assert robot[Docking].home is None
    world.faults.clear(fault.number)
    await ok(await client.put(f"{SLAM}/homepose", json=home))
    assert robot[Docking].home == Pose(5.0, 1.0, 0.5)
    (own,) = (await client.get(f"{SLAM}/homedocks")).json()
    assert own["metadata"] == {"display_name": "home"}


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
    moved = {"pose": {"x": 4.0, "y": 1.0, "yaw": 0.5}, "metadata": {}}  # as in the manual's example
    await ok(await client.put(f"{docks}/second", json=moved))
    assert robot[Docking].home == Pose(4.0, 1.0, 0.5)
    assert (await client.get(docks)).json() == [{**second, "pose": moved["pose"]}]
    assert (await client.put(f"{docks}/unknown", json=moved)).status_code == 404
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


@pytest.mark.parametrize("bound", [None, "near"])
async def test_home_pose_chooses_a_dock(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, bound: str | None
) -> None:
    """With several docks on the map, the client sets which one is in use: the others stay where they are."""
    await forward(seconds=1)
    named = [
        {"id": id, "pose": {"x": x, "y": 0.0, "yaw": 0.5}, "metadata": {"display_name": id}}
        for id, x in (("near", 1.0), ("far", 9.0))
    ]
    await ok(await client.put(f"{SLAM}/homedocks", json=named))
    current = f"{MULTI}/homedocks/:current"
    if bound:
        await ok(await client.post(f"{MULTI}/stcm/:sync"))
        await ok(await client.put(current, json={"dock_id": bound}))
    await ok(await client.put(f"{SLAM}/homepose", json={"x": 9.0, "y": 0.0, "yaw": 0.5}))
    assert robot[Docking].home == Pose(9.0, 0.0, 0.5)
    docks = (await client.get(f"{SLAM}/homedocks")).json()
    assert sorted(docks, key=lambda dock: dock["pose"]["x"]) == named
    assert (await client.get(current)).json().get("data", {}).get("id") == (bound and "far")
    await ok(await client.put(f"{SLAM}/homepose", json={"x": 8.0, "y": 0.0, "yaw": 0.5}))  # at none: moves it
    xs = {dock["id"]: dock["pose"]["x"] for dock in (await client.get(f"{SLAM}/homedocks")).json()}
    assert xs == {"near": 1.0, "far": 8.0}


async def test_clearing_docks_answers_the_former_home_or_null(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    docks = "/api/core/slam/v1/homedocks"
    entry = {"id": "d", "pose": {"x": 0.0, "y": 1.0, "yaw": 0.0}, "metadata": {"display_name": "d"}}
    assert (await client.put(docks, json=[entry])).status_code == 200
    assert (await client.delete(docks)).json()["id"] == "d"
    assert (await client.delete(docks)).json() is None


def with_dock(floor: FloorMap, id: str) -> FloorMap:
    dock = PointOfInterest(id, Pose(1.0), {"display_name": id})
    return replace(floor, annotations=replace(floor.annotations, docks=(dock,)))


async def test_home_is_on_start_or_bound_floor(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    grid, current = robot[Mapping].grid, f"{MULTI}/floors/:current"
    lower, upper = (FloorMap(FloorName("A", name, order, default=not order), grid) for order, name in enumerate("12"))
    layers = (*composite_of(with_dock(lower, "below")).layers, *composite_of(with_dock(upper, "above")).layers)
    await ok(await client.post(f"{MULTI}/stcm", content=encode_stcm(CompositeMap(layers))))
    await ok(await client.post(f"{MULTI}/stcm/:reload"))

    async def start_floors() -> list[str]:
        return [floor["floor"] for floor in (await client.get(f"{MULTI}/floors")).json() if floor["is_default_floor"]]

    maps = robot[Storeys].maps
    assert maps is not None
    await ok(await client.put(current, json={"building": "A", "floor": "2"}))
    assert (maps.current, maps.home(), await start_floors()) == ("A/2", "A/1", ["1"])  # although this one has a dock
    await ok(await client.put(f"{MULTI}/homedocks/:current", json={"dock_id": "above"}))
    assert (maps.home(), await start_floors()) == ("A/2", ["2"])
    await ok(await client.post(f"{MULTI}/stcm/:reload"))  # as after a restart
    assert (await client.get(current)).json()["floor"] == "2"


async def test_binding_start_floors_dock_moves_no_robot(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    """Only a dock elsewhere asks for a robot that was pushed onto it: this one is upstairs, and stays there."""
    grid, current = robot[Mapping].grid, f"{MULTI}/floors/:current"
    lower, upper = (FloorMap(FloorName("A", name, order, default=not order), grid) for order, name in enumerate("12"))
    layers = (*composite_of(with_dock(lower, "below")).layers, *composite_of(with_dock(upper, "above")).layers)
    await ok(await client.post(f"{MULTI}/stcm", content=encode_stcm(CompositeMap(layers))))
    await ok(await client.post(f"{MULTI}/stcm/:reload"))
    pose = {"x": 0.5, "y": 0.25, "yaw": 0.0}
    await ok(await client.put(current, json={"building": "A", "floor": "2", "pose": pose}))
    await ok(await client.put(f"{MULTI}/homedocks/:current", json={"dock_id": "below"}))
    assert (await client.get(current)).json()["floor"] == "2"
    assert robot[Localization].pose.distance_to(Pose(0.5, 0.25)) < 0.1
    assert (await client.get(f"{MULTI}/homedocks/:current")).json()["data"]["floor"] == "1"
    for bound in ("above", "below"):  # the first is on its floor; the second on neither: it was pushed there
        await ok(await client.put(f"{MULTI}/homedocks/:current", json={"dock_id": bound}))
    assert (await client.get(current)).json()["floor"] == "1"
    assert robot[Localization].pose.distance_to(Pose(1.0)) < 0.1


async def test_map_with_a_dock_far_away_is_loaded(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    await ok(await client.put(f"{SLAM}/homepose", json={"x": 0.8, "y": -90_000.0, "yaw": 2.0}))
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    await ok(await client.post(f"{MULTI}/stcm/:reload"))
    assert (await client.get("/api/multi-floor/status")).json()["map_load_status"] == "LOADED"
    assert len((await client.get(f"{MULTI}/floors")).json()) == 1
