"""Places of the loaded map by name, by nearness and in order, through a real socket."""

from __future__ import annotations

import itertools
import math
import time

import httpx
import pytest

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.driving import Driving
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.testing import Forward
from tests.protocols.slamware.drawings import ok

ARTIFACT, MULTI = "/api/core/artifact/v1", "/api/multi-floor/map/v1"


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


async def test_a_lost_robot_is_placed_by_name(robot: Robot, client: httpx.AsyncClient, drawn: None) -> None:
    pose, dock = "/api/multi-floor/localization/v1/pose", "/api/multi-floor/localization/v1/homedock"
    assert (await client.put(pose, json={"poi_name": "desk"})).status_code == 404  # not loaded yet
    await ok(await client.post(f"{MULTI}/stcm/:sync"))
    assert (await ok(await client.put(pose, json={"poi_name": "desk"}))).json() is True
    assert robot[Localization].pose.distance_to(Pose(1.0, 0.5)) < 0.01
    await ok(await client.put(dock))
    assert robot[Localization].pose.distance_to(Pose(0.6)) < 0.05
    assert (await client.put(dock, json={"dock_id": "unknown"})).status_code == 404


@pytest.mark.slow  # in short: test_places_are_ordered_by_ways_that_lead_there
@pytest.mark.world("empty")
async def test_places_are_ordered_by_the_ways_between_them(client: httpx.AsyncClient, forward: Forward) -> None:
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
    assert (await client.post(dispatch, json=["a", "far"])).status_code == 400  # off the known map


@pytest.mark.slow
@pytest.mark.world("empty")
async def test_hundreds_of_places_are_ordered_within_a_second(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    spots = {f"p{n}": (1.5 * math.cos(n * 0.7), 1.5 * math.sin(n * 0.7)) for n in range(300)}  # turning on the spot
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
