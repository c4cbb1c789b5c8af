"""The map of several floors that ships: it is the one of the office, and a robot rides by it."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest

from roboglot.cli.maps.survey import surveyed
from roboglot.fleet import Fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.simulation.world.world_files import load_world
from roboglot.testing import Forward
from tests.autonomy.delivery_robot import delivery_robot

SHIPPED = Path(__file__).parents[4] / "examples" / "maps" / "office.stcm"
MULTI, ACTIONS = "/api/multi-floor/map/v1", "/api/core/motion/v1/actions"


@pytest.fixture
async def fleet(clock: LockstepClock) -> AsyncIterator[Fleet]:
    async with delivery_robot(clock) as fleet:
        yield fleet


def test_the_shipped_map_is_of_the_shipped_office() -> None:
    assert SHIPPED.read_bytes() == surveyed(load_world("office")), "roboglot map survey examples/maps/office.stcm"


async def loaded(client: httpx.AsyncClient, at: Pose) -> None:
    """Load the shipped map, the robot being there."""
    assert (await client.post(f"{MULTI}/stcm", content=SHIPPED.read_bytes())).status_code == 200
    pose = {"x": at.x, "y": at.y, "yaw": at.yaw}
    assert (await client.post(f"{MULTI}/stcm/:reload", json={"pose": pose})).status_code == 200
    assert [floor["floor"] for floor in (await client.get(f"{MULTI}/floors")).json()] == ["ground", "first", "second"]


async def test_robot_finds_its_place_on_shipped_map(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    await forward(seconds=1)
    here = world.truth.pose_of("a")
    await loaded(client, here.compose(Pose(0.1, 0.1, 0.05)))
    await forward(seconds=2)
    found = robot[Localization].pose  # the map's frame is the world's
    assert found.distance_to(here) < 0.03
    assert abs(found.relative_to(here).yaw) < 0.02


@pytest.mark.slow  # a long story; in short: the place above, and rides in test_elevators.py
async def test_a_robot_rides_by_the_shipped_map(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    await forward(seconds=1)
    await loaded(client, world.truth.pose_of("a"))
    options = {"target": {"poi_name": "first lift"}}
    body = {"action_name": "slamtec.agent.actions.MultiFloorMoveAction", "options": options}
    id = (await client.post(ACTIONS, json=body)).json()["action_id"]
    for _ in range(600):
        state = (await client.get(f"{ACTIONS}/{id}")).json()["state"]
        if state["status"] == 4:
            break
        await forward(seconds=0.5)
    assert (state["result"], state["reason"]) == (0, "")
    there = world.truth.pose_of("a")
    assert world.truth.floor_of("a") == 1
    assert there.distance_to(robot[Localization].pose) < 0.15  # the map's frame is the world's
    assert abs(there.x - 2.95) < 0.3
    assert abs(there.y - 10.0) < 0.3
