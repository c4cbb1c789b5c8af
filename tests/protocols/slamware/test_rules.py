"""Annotations drawn through the API change how the robot goes: a real socket, the simulated robot."""

from __future__ import annotations

import itertools
import math

import httpx
import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward

pytestmark = pytest.mark.world("empty")
ARTIFACT, MOTION = "/api/core/artifact/v1", "/api/core/motion/v1"
AREAS, WALLS, TRACKS = f"{ARTIFACT}/rectangle-areas", f"{ARTIFACT}/lines/walls", f"{ARTIFACT}/lines/tracks"
MOVE_TO = "slamtec.agent.actions.MoveToAction"


def line(x1: float, y1: float, x2: float, y2: float) -> dict[str, object]:
    return {"start": {"x": x1, "y": y1}, "end": {"x": x2, "y": y2}, "metadata": {}}


async def path(client: httpx.AsyncClient, x: float, y: float) -> list[tuple[float, float]]:
    answer = await client.post(f"{MOTION}/:search_path", json={"target": {"x": x, "y": y}})
    assert answer.status_code == 200, answer.text
    return [(p[0], p[1]) for p in answer.json()["path_points"]]


async def test_a_wall_is_gone_around(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    straight = await path(client, 2.0, 0.0)
    assert max(abs(y) for _, y in straight) < 0.2
    await client.post(WALLS, json=[line(1.0, -1.0, 1.0, 1.0)])
    around = await path(client, 2.0, 0.0)
    assert max(abs(y) for _, y in around) > 1.0
    await client.delete(WALLS)
    assert max(abs(y) for _, y in await path(client, 2.0, 0.0)) < 0.2


async def test_a_forbidden_area_is_gone_around(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    area = {"start": {"x": 0.8, "y": 0.0}, "end": {"x": 1.2, "y": 0.0}, "half_width": 1.0}
    await client.post(f"{AREAS}/forbidden_area", json={"area": area, "metadata": {"escape_distance": "0.1"}})
    assert max(abs(y) for _, y in await path(client, 2.5, 0.0)) > 1.0


@pytest.mark.parametrize(
    ("metadata", "depth", "leaves"),
    [({}, 0.9, True), ({"escape_distance": "0.4"}, 0.2, True), ({"escape_distance": "0.4"}, 0.6, False)],
)
async def test_forbidden_area_is_left_from_its_edge(
    client: httpx.AsyncClient, forward: Forward, metadata: dict[str, str], depth: float, leaves: bool
) -> None:
    """The area that a robot can escape from is counted from the border inwards."""
    await forward(seconds=1)
    area = {"start": {"x": -depth, "y": 0.0}, "end": {"x": 3.0, "y": 0.0}, "half_width": 2.0}
    await client.post(f"{AREAS}/forbidden_area", json={"area": area, "metadata": metadata})
    assert bool(await path(client, 1.0, 3.0)) is leaves
    assert await path(client, 1.0, 0.0)  # within it, it moves


async def test_a_dangerous_area_is_crossed_slowly(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    area = {"start": {"x": -1.0, "y": 0.0}, "end": {"x": 5.0, "y": 0.0}, "half_width": 2.0}
    metadata = {"dangerous_area_type": "0", "max_line_speed": "0.25"}
    await client.post(f"{AREAS}/dangerous_area", json={"area": area, "metadata": metadata})
    action = {"action_name": MOVE_TO, "options": {"target": {"x": 3.0, "y": 0.0}}}
    assert (await client.post(f"{MOTION}/actions", json=action)).status_code == 200
    fastest = 0.0
    for _ in range(50):
        await forward(seconds=0.1)
        fastest = max(fastest, math.hypot(robot[Base].velocity.x, robot[Base].velocity.y))
    assert 0.1 < fastest < 0.27
    await client.delete(f"{MOTION}/actions/:current")
    await forward(seconds=2)


async def test_strict_tracks_are_kept_to(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    strict = {"target": {"x": 2.0, "y": 0.0}, "move_options": {"mode": 1}}
    action = {"action_name": MOVE_TO, "options": strict}
    assert (await client.post(f"{MOTION}/actions", json=action)).status_code == 400  # there are no tracks
    corners = [(0.3, 0.0), (0.3, 1.5), (2.0, 1.5), (2.0, 0.0)]
    await client.post(TRACKS, json=[line(*a, *b) for a, b in itertools.pairwise(corners)])
    assert (await client.post(f"{MOTION}/actions", json=action)).status_code == 200
    await forward(seconds=2)
    points = (await client.get(f"{MOTION}/path")).json()["path_points"]
    assert max(y for _, y in points) > 1.3
    await client.delete(f"{MOTION}/actions/:current")
    await forward(seconds=2)


@pytest.mark.parametrize("flag", [True, pytest.param(False, marks=pytest.mark.slow)])
async def test_person_in_way_is_waited_for_or_passed(
    client: httpx.AsyncClient, world: World, forward: Forward, flag: bool
) -> None:
    await forward(seconds=2)
    origin = world.truth.pose_of("a")
    await client.put("/api/core/slam/v1/mapping/:enable", json={"enable": False})
    how = {"flags": ["find_path_ignoring_dynamic_obstacles"] if flag else []}
    options = {"target": {"x": 4.0, "y": 0.0}, "move_options": how}
    action = {"action_name": MOVE_TO, "options": options}
    assert (await client.post(f"{MOTION}/actions", json=action)).status_code == 200
    await forward(seconds=1.5)
    (box,) = world.faults.inject("blocked_path", "a", ahead=0.9, width=0.8)
    aside = 0.0
    for _ in range(16 if flag else 40):
        await forward(seconds=0.5)
        aside = max(aside, abs(world.truth.pose_of("a").relative_to(origin).y))
    here = world.truth.pose_of("a").relative_to(origin)
    assert (here.x < 2.0, aside < 0.15) == (flag, flag)
    world.faults.clear(box.number)
    await forward(seconds=15)
    assert world.truth.pose_of("a").relative_to(origin).distance_to(Pose(4.0)) < 0.15
