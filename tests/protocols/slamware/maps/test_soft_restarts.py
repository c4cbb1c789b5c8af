"""Changes that clients make while the robot's software restarts hold; the map on disk is loaded before."""

from __future__ import annotations

from dataclasses import replace

import httpx
import numpy as np
import pytest

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.sensor_masks import SensorMasks
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, FloorName, composite_of
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from roboglot.wire.slamware.chapters.slam.stcm import encode_stcm
from tests.protocols.slamware.drawings import DESK, WALL, ok
from tests.protocols.slamware.maps.test_maps import ARTIFACT, MULTI, SLAM, STCM

MASKS = "/api/core/sensors/v1/masks"


async def restart(client: httpx.AsyncClient) -> None:
    await ok(await client.post("/api/core/system/v1/power/:restartmodule", json={"mode": "RestartModeSoft"}))


async def test_a_map_set_during_a_restart_stays(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    grid = robot[Mapping].grid
    other = replace(grid, log_odds=np.pad(grid.log_odds, ((0, 0), (0, 300)), constant_values=-100))
    await restart(client)
    await ok(await client.put(STCM, content=encode_stcm(composite_of(FloorMap(FloorName(), other)))))
    await ok(await client.post(f"{ARTIFACT}/pois", json={**DESK, "id": "new"}))
    await ok(await client.post(f"{ARTIFACT}/lines/walls", json=[WALL, WALL]))
    await forward(seconds=10)
    assert robot[Mapping].grid.width == grid.width + 300
    assert [place.id for place in robot[Places].all()] == ["new"]
    assert len((await client.get(f"{ARTIFACT}/lines/walls")).json()) == 2


@pytest.mark.parametrize("seconds", [0, 2])
async def test_pose_and_masks_set_during_a_restart_stay(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, drawn: None, seconds: int
) -> None:
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    await ok(await client.put(f"{SLAM}/localization/:enable", json={"enable": False}))
    masked = robot[SensorMasks].sensors[0].id
    await restart(client)
    await forward(seconds=seconds)
    await ok(await client.put(f"{SLAM}/localization/pose", json={"x": 1.5, "y": 1.0, "yaw": 0.5}))
    await ok(await client.put(MASKS, json=[{"id": masked, "isAlways": False, "isEnabled": False}]))
    await forward(seconds=10)
    assert robot[Localization].pose.distance_to(Pose(1.5, 1.0)) < 0.01
    assert robot[SensorMasks].masked == {masked: False}


@pytest.mark.slow  # in short: test_pose_and_masks_set_during_a_restart_stay
async def test_a_driving_robot_keeps_its_place(
    robot: Robot, world: World, client: httpx.AsyncClient, forward: Forward, drawn: None
) -> None:
    """It brakes while the map is loaded."""
    start = world.truth.pose_of("a")
    await ok(await client.post(f"{MULTI}/stcm/:save"))
    robot[Driving].move_by(Pose(3.0))
    await forward(seconds=3)
    await restart(client)
    await forward(seconds=10)
    assert start.distance_to(world.truth.pose_of("a")) > 0.5
    assert start.compose(robot[Localization].pose).distance_to(world.truth.pose_of("a")) < 0.1
