"""Docking at printed tags and reflectors, through a real socket, judged by the world."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import httpx
import pytest

from roboglot.model.geometry import Pose
from roboglot.simulation.world.world import World
from roboglot.testing import Forward

ACTIONS = "/api/core/motion/v1/actions"
SUCCESS = {"status": 4, "result": 0, "reason": ""}
WORLD = Path(__file__).parents[1] / "data" / "tags.toml"
pytestmark = pytest.mark.world(str(WORLD), body="universal")
TAG, STRIPS = Pose(8.0, 3.0, math.pi), Pose(8.0, 6.0, math.pi)  # world frame, on the eastern wall


async def run(client: httpx.AsyncClient, forward: Forward, name: str, **options: object) -> Any:
    reply = await client.post(ACTIONS, json={"action_name": f"agent.actions.{name}", "options": options})
    assert reply.status_code == 200, reply.text
    id = reply.json()["action_id"]
    for _ in range(400):
        state = (await client.get(f"{ACTIONS}/{id}")).json()["state"]
        if state["status"] == 4:
            return state
        await forward(seconds=0.5)
    raise AssertionError(f"{name} has not ended")


def before(tag: Pose, away: float, aside: float, origin: Pose) -> dict[str, float]:
    """Return the map pose ``away`` m before the tag, facing it."""
    pose = tag.compose(Pose(away, aside, math.pi)).relative_to(origin)
    return {"x": pose.x, "y": pose.y, "yaw": pose.yaw}


@pytest.mark.parametrize(
    ("kind", "tag", "more", "backwards"),
    [
        pytest.param(0, TAG, {"tag_ids": [4]}, False, marks=pytest.mark.slow),
        (2, STRIPS, {"reflect_tag_num": 2}, True),
        pytest.param(0, TAG, {"tag_ids": [4]}, True, marks=pytest.mark.slow),
        pytest.param(2, STRIPS, {"reflect_tag_num": 2}, False, marks=pytest.mark.slow),
    ],
)
async def test_up_to_it_and_away_again(
    client: httpx.AsyncClient, world: World, forward: Forward, kind: int, tag: Pose, more: object, backwards: bool
) -> None:
    origin = world.truth.pose_of("a")
    await forward(seconds=1)
    assert isinstance(more, dict)
    options = {
        "target": before(tag, 1.8, 0.2, origin),
        "tag_type": kind,
        "target_relative_pose": {"x": 0.6, "y": 0.0},
        "backward_docking": backwards,
        **more,
    }
    assert await run(client, forward, "MoveToTagAction", **options) == SUCCESS
    stands = world.truth.pose_of("a").relative_to(tag)
    assert (stands.x, stands.y) == (pytest.approx(0.6, abs=0.06), pytest.approx(0.0, abs=0.05))
    assert math.cos(stands.yaw) == pytest.approx(1.0 if backwards else -1.0, abs=0.01)
    options = {"tag_type": kind, "backup_distance": 0.5, "backward_docking": backwards, "backup_mode": 1}
    assert await run(client, forward, "BackOffFromTagAction", **options) == SUCCESS
    stands = world.truth.pose_of("a").relative_to(tag)
    assert stands.x == pytest.approx(1.1, abs=0.08)
    assert abs(stands.y) < 0.1


async def test_another_tag_is_not_taken_for_it(client: httpx.AsyncClient, world: World, forward: Forward) -> None:
    origin = world.truth.pose_of("a")
    await forward(seconds=1)
    options = {"target": before(TAG, 1.8, 0.0, origin), "tag_type": 0, "tag_ids": [9]}
    state = await run(client, forward, "MoveToTagAction", **options)
    assert (state["result"], state["reason"]) == (-1, "the mark (printed) was not found")


MARKS = str(Path(__file__).parents[3] / "autonomy" / "worlds" / "marks.toml")


@pytest.mark.slow  # from a place: test_from_a_place_by_its_name
@pytest.mark.world(MARKS, body="hermes")
async def test_board_that_the_lidar_knows_by_its_shape(
    client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    origin = world.truth.pose_of("a")
    await forward(seconds=1)
    seen_from = Pose(6.8, 2.0, -math.pi / 2).relative_to(origin)
    target = {"x": seen_from.x, "y": seen_from.y, "yaw": seen_from.yaw}
    stages = []
    body = {"action_name": "agent.actions.MoveToTagAction", "options": {"target": target, "tag_type": 1}}
    id = (await client.post(ACTIONS, json=body)).json()["action_id"]
    for _ in range(200):
        await forward(seconds=0.5)
        info = (await client.get(f"{ACTIONS}/{id}")).json()
        if info["state"]["status"] == 4:
            break
        stages += [info["stage"]] if info["stage"] not in stages[-1:] else []
    assert info["state"] == SUCCESS
    assert stages == ["MOVE_TO_LANDING_POINT", "DETECT_MARKER", "LANDING"] or stages[0] == "MOVE_TO_LANDING_POINT"
    stands = world.truth.pose_of("a")
    assert (stands.x, stands.y) == (pytest.approx(7.0, abs=0.03), pytest.approx(0.92, abs=0.03))
    options = {"tag_type": 1, "backup_mode": 1, "backup_distance": 0.5}
    assert await run(client, forward, "BackOffFromTagAction", **options) == SUCCESS
    assert world.truth.pose_of("a").y == pytest.approx(1.42, abs=0.04)


@pytest.mark.slow  # in short: test_up_to_it_and_away_again
@pytest.mark.world(MARKS, body="hermes")
async def test_from_a_place_by_its_name(client: httpx.AsyncClient, world: World, forward: Forward) -> None:
    seen_from = Pose(6.8, 2.0, -math.pi / 2).relative_to(world.truth.pose_of("a"))
    await forward(seconds=1)
    pose = {"x": seen_from.x, "y": seen_from.y, "yaw": seen_from.yaw}
    place = {"id": "p1", "pose": pose, "metadata": {"display_name": "bay"}}
    await client.post("/api/core/artifact/v1/pois", json=place)
    options = {"target": {"poi_name": "bay"}, "move_to_tag_options": {"tag_type": 1, "move_options": {"mode": 0}}}
    assert await run(client, forward, "SchedulableMoveToTagAction", **options) == SUCCESS
    assert world.truth.pose_of("a").y == pytest.approx(0.92, abs=0.03)
    options["target"] = {"poi_name": "nowhere"}
    body = {"action_name": "agent.actions.SchedulableMoveToTagAction", "options": options}
    assert (await client.post(ACTIONS, json=body)).status_code == 400


@pytest.mark.slow
@pytest.mark.world(str(WORLD.with_name("shelf.toml")), body="hermes")
async def test_under_a_shelf_nearby(client: httpx.AsyncClient, world: World, forward: Forward) -> None:
    origin = world.truth.pose_of("a")
    await forward(seconds=1)
    seen_from = Pose(2.6, 2.1, 0.0).relative_to(origin)
    target = {"x": seen_from.x, "y": seen_from.y, "yaw": seen_from.yaw}
    assert await run(client, forward, "MoveToTagAction", target=target, tag_type=3) == SUCCESS
    stands = world.truth.pose_of("a")
    assert (stands.x, stands.y) == (pytest.approx(4.5, abs=0.03), pytest.approx(2.0, abs=0.03))


@pytest.mark.world(MARKS, body="hermes")
@pytest.mark.slow  # from afar and not all the way; the shelf itself: test_under_a_shelf_nearby
@pytest.mark.parametrize(("more", "x"), [({}, 7.5), ({"dock_allowance": 0.2}, 7.12)])
async def test_under_a_shelf(
    client: httpx.AsyncClient, world: World, forward: Forward, more: dict[str, float], x: float
) -> None:
    origin = world.truth.pose_of("a")
    await forward(seconds=1)
    seen_from = Pose(5.6, 6.1, 0.0).relative_to(origin)
    target = {"x": seen_from.x, "y": seen_from.y, "yaw": seen_from.yaw}
    assert await run(client, forward, "MoveToTagAction", target=target, tag_type=3, **more) == SUCCESS
    stands = world.truth.pose_of("a")
    assert (stands.x, stands.y) == (pytest.approx(x, abs=0.03), pytest.approx(6.0, abs=0.03))
