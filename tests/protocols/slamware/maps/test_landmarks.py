"""Laser landmarks: what the lidar found is reported, what is set helps a lost robot; restricted areas count robots."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from roboglot.fleet import Fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.world.world import World
from roboglot.testing import Forward

LANDMARKS, ACTIONS = "/api/core/artifact/v1/laser-landmarks", "/api/core/motion/v1/actions"
STRIPS = str(Path(__file__).parents[3] / "autonomy" / "worlds" / "strips.toml")
PLACES = [(0.0, 5.0), (0.0, 6.1), (8.0, 6.6), (3.2, 8.0)]  # of the strips, in the world


async def go(client: httpx.AsyncClient, forward: Forward, goal: Pose) -> None:
    options = {"target": {"x": goal.x, "y": goal.y}, "move_options": {"flags": ["with_yaw"], "yaw": goal.yaw}}
    body = {"action_name": "agent.actions.MoveToAction", "options": options}
    assert (await client.post(ACTIONS, json=body)).status_code == 200
    for _ in range(60):
        await forward(seconds=1)
        if (await client.get(f"{ACTIONS}/:current")).status_code == 404:
            return
    raise AssertionError("it did not arrive")


@pytest.mark.slow
@pytest.mark.world(STRIPS)
async def test_found_switched_off_and_set(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    async def marks() -> list[Any]:
        return list((await client.get(LANDMARKS)).json())

    start = world.truth.pose_of("a")
    assert (await client.get(f"{LANDMARKS}/:update")).json() is True
    await forward(seconds=1)
    await go(client, forward, Pose(4.0, 4.6, math.pi / 2).relative_to(start))
    await forward(seconds=3)
    found = await marks()
    places = [start.compose(Pose(mark["pose"]["x"], mark["pose"]["y"])) for mark in found]
    assert len(found) == 4
    for x, y in PLACES:
        assert min(place.distance_to(Pose(x, y)) for place in places) < 0.08
    assert (await client.put(f"{LANDMARKS}/:update", json={"enable": False})).json() is True
    assert (await client.get(f"{LANDMARKS}/:update")).json() is False
    assert (await client.delete(LANDMARKS)).json() is True
    await forward(seconds=10)
    assert await marks() == []  # no strip is added
    robot[Localization].set_pose(Pose(-5.0, -5.0, 1.0))
    await forward(seconds=5)
    assert (await client.put(LANDMARKS, json=found)).json() is True
    await forward(seconds=25)
    assert start.compose(robot[Localization].pose).distance_to(world.truth.pose_of("a")) < 0.1
    assert [mark["id"] for mark in await marks()] == [mark["id"] for mark in found]


async def test_a_landmark_without_a_pose_is_refused(bare_client: httpx.AsyncClient) -> None:
    reply = await bare_client.put(LANDMARKS, json=[{"id": "a", "pose": {"x": 1, "y": 2}}, {"id": "b"}])
    assert (reply.status_code, reply.text) == (400, "Bad Request: the landmark b needs a pose")
    assert (await bare_client.get(LANDMARKS)).json() == []


@pytest.fixture
async def clients(fleet: Fleet, forward: Forward) -> AsyncIterator[dict[str, httpx.AsyncClient]]:
    """A door and a client for each robot."""
    doors = {name: SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0)) for name, robot in fleet.robots.items()}
    for door in doors.values():
        await door.start()
    yield {
        n: httpx.AsyncClient(base_url=door.endpoints[0].address, timeout=60, verify=False) for n, door in doors.items()
    }
    for door in doors.values():
        await door.close()
    await forward(seconds=4)


@pytest.mark.world("empty", robots=("a", "b"))
@pytest.mark.slow  # tests/autonomy/navigation/test_restricted.py has the rule
@pytest.mark.parametrize("changed", [True, False])
async def test_one_robot_at_time_in_a_restricted_area(
    clients: dict[str, httpx.AsyncClient], fleet: Fleet, world: World, clock: LockstepClock, changed: bool
) -> None:
    starts = {"a": Pose(3.0, 4.5), "b": Pose(7.0, 3.0)}
    for name, pose in starts.items():
        world.stage.place(name, pose)
    await clock.advance(0.5)
    for name, robot in fleet.robots.items():
        robot[Mapping].clear()
        origin = world.truth.pose_of(name)
        ends = [Pose(5.0, y).relative_to(origin).point for y in (6.0, 8.0)]
        area = {"start": {"x": ends[0].x, "y": ends[0].y}, "end": {"x": ends[1].x, "y": ends[1].y}, "half_width": 5.0}
        path, client = "/api/core/artifact/v1/rectangle-areas/restricted_area", clients[name]
        metadata = {"restricted_robots_number_limit": "1"}
        first = {"area": area, "metadata": {"restricted_robots_number_limit": "2"} if changed else metadata}
        assert (await client.post(path, json=first)).json() is True
        if changed:
            (known,) = (await client.get(path)).json()
            reply = await client.put(f"{path}/{known['id']}", json={"area": area, "metadata": metadata})
            assert reply.json() is True
    await clock.advance(1.0)
    for name, client in clients.items():
        goal = Pose(starts[name].x, 9.2).relative_to(starts[name])
        body = {"action_name": "agent.actions.MoveToAction", "options": {"target": {"x": goal.x, "y": goal.y}}}
        assert (await client.post(ACTIONS, json=body)).status_code == 200
    crowd, waited = 0, set()
    for _ in range(120):
        await clock.advance(0.5)
        crowd = max(crowd, sum(6.0 < world.truth.pose_of(name).y < 8.0 for name in starts))
        states = {name: await client.get(f"{ACTIONS}/:current") for name, client in clients.items()}
        waited |= {n for n, s in states.items() if s.status_code == 200 and s.json()["state"]["status"] == 3}
        if all(state.status_code == 404 for state in states.values()):
            break
    assert (crowd, len(waited)) == (1, 1)
    assert all(world.truth.pose_of(name).y > 9.0 for name in starts)
    for client in clients.values():
        await client.aclose()
