"""Bumpers during motion, as clients of the REST door see them."""

from typing import Any

import httpx
import pytest

from roboglot.model.geometry import Pose
from roboglot.simulation.world.world import World
from roboglot.testing import Forward

pytestmark = pytest.mark.world("empty")
ACTIONS, EVENTS = "/api/core/motion/v1/actions", "/api/platform/v1/events"
FORWARD, BACKWARD = 0, 1


async def push(client: httpx.AsyncClient, direction: int) -> httpx.Response:
    options = {"direction": direction, "duration": 2000}
    return await client.post(ACTIONS, json={"action_name": "slamtec.agent.actions.MoveByAction", "options": options})


async def state(client: httpx.AsyncClient, reply: httpx.Response) -> Any:
    return (await client.get(f"{ACTIONS}/{reply.json()['action_id']}")).json()["state"]


async def triggered(client: httpx.AsyncClient) -> int:
    return sum(event["type"] == "BUMPER_TRIGGERED" for event in (await client.get(EVENTS)).json())


async def test_wall_ends_move_and_only_backwards_is_free(
    client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    world.stage.place("a", Pose(9.5, 5.0, 0.0))
    await forward(seconds=1)
    reply = await push(client, FORWARD)
    await forward(seconds=1.5)
    ended = await state(client, reply)
    assert (ended["status"], ended["result"]) == (4, -1)
    assert ended["reason"]
    assert await triggered(client) == 1
    where = world.truth.pose_of("a")
    for _ in range(10):
        refused = await push(client, FORWARD)
        assert refused.status_code == 400
        assert "bumper" in refused.text
        await forward(seconds=0.2)
    assert world.truth.pose_of("a").distance_to(where) < 0.01
    assert (await push(client, BACKWARD)).status_code == 200
    await forward(seconds=1)
    assert world.truth.pose_of("a").x < where.x - 0.2


async def test_a_robot_in_plain_view_is_not_shoved(client: httpx.AsyncClient, world: World, forward: Forward) -> None:
    world.stage.place("a", Pose(2.0, 5.0, 0.0))
    box = Pose(4.0, 5.0)
    world.stage.add_obstacle(box, (0.3, 0.3, 0.15))  # lower than the lidar's plane
    await forward(seconds=1)
    reply = await push(client, FORWARD)
    for _ in range(12):
        await forward(seconds=0.5)
        await push(client, FORWARD)
    assert (await state(client, reply))["result"] == -1
    assert world.truth.pose_of("a").x == pytest.approx(4.0 - 0.15 - 0.25, abs=0.01)


@pytest.mark.world("empty", body="hermes")
async def test_emergency_braking_ends_the_move_with_its_reason(
    client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    world.stage.place("a", Pose(3.0, 5.0, 0.0))
    world.stage.add_obstacle(Pose(5.0, 5.0), (0.3, 1.0, 1.0))
    await forward(seconds=1)
    for _ in range(20):
        reply = await push(client, FORWARD)
        if reply.status_code != 200:
            break
        await forward(seconds=3.0)
        ended = await state(client, reply)
        assert ended["status"] == 4
        if ended["result"] == -1:
            assert ended["reason"] == "PATH_OCCUPIED"
    refused = await push(client, FORWARD)
    assert refused.status_code == 400
    assert "emergency braking" in refused.text
    assert await triggered(client) == 0  # it touches nothing
    where = world.truth.pose_of("a")
    assert where.x < 5.0 - 0.15 - 0.25
    assert (await push(client, BACKWARD)).status_code == 200
    await forward(seconds=1)
    assert world.truth.pose_of("a").x < where.x - 0.2
