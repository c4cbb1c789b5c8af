"""The docks of the map and the one that is home, through a real socket."""

from __future__ import annotations

import math

import httpx

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.docking import Docking
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.testing import Forward
from tests.protocols.slamware.drawings import ok

SLAM, MULTI = "/api/core/slam/v1", "/api/multi-floor/map/v1"


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


async def test_clearing_docks_answers_the_former_home_or_null(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    docks = "/api/core/slam/v1/homedocks"
    entry = {"id": "d", "pose": {"x": 0.0, "y": 1.0, "yaw": 0.0}, "metadata": {"display_name": "d"}}
    assert (await client.put(docks, json=[entry])).status_code == 200
    assert (await client.delete(docks)).json()["id"] == "d"
    assert (await client.delete(docks)).json() is None
