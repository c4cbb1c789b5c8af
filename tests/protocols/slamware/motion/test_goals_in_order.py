"""Actions with several goals, through a real socket: one that succeeds was at all of them in turn, by the truth."""

from __future__ import annotations

import random

import httpx
import pytest

from roboglot.model.geometry import Point
from roboglot.simulation.world.world import World
from roboglot.testing import Forward, passed_in_order

ACTIONS = "/api/core/motion/v1/actions"
WITHIN = 0.1 + 0.03  # m: acceptable_precision's default, plus the error of localization
THERE_AND_BACK = [(1.2, 1.8), (1.2, 0.3), (1.2, 1.8)]


def crossing(seed: int) -> list[tuple[float, float]]:
    """Goals (m) to and fro between four places, with neighbours that are the same."""
    draw = random.Random(seed)
    places = [(round(draw.uniform(1.0, 4.0), 2), round(draw.uniform(-2.0, 2.0), 2)) for _ in range(4)]
    return [places[0], places[1], places[1], places[2], places[0], places[3], places[0]]


@pytest.mark.slow  # in short: test_through_several_points
@pytest.mark.parametrize(
    ("name", "spots"),
    [
        ("SeriesMoveToAction", THERE_AND_BACK),
        pytest.param("FollowPathPointsAction", crossing(2), marks=pytest.mark.slow),
    ],
)
@pytest.mark.world("empty", body="hermes")
async def test_success_means_every_goal_was_reached(
    world: World, client: httpx.AsyncClient, forward: Forward, name: str, spots: list[tuple[float, float]]
) -> None:
    await forward(seconds=1)
    start = world.truth.pose_of("a")
    key = "targets" if name == "SeriesMoveToAction" else "path_points"
    body = {"action_name": f"slamtec.agent.actions.{name}", "options": {key: [{"x": x, "y": y} for x, y in spots]}}
    id = (await client.post(ACTIONS, json=body)).json()["action_id"]
    track, left = [world.truth.pose_of("a").relative_to(start)], [len(spots)]
    for step in range(1200):
        await forward(seconds=0.1)
        track.append(world.truth.pose_of("a").relative_to(start))
        if step % 5 == 0:
            state = (await client.get(f"{ACTIONS}/{id}")).json()["state"]
            if state["status"] == 4:
                break
            left.append(len((await client.get("/api/core/motion/v1/milestones")).json()["path_points"]))
    assert state == {"status": 4, "result": 0, "reason": ""}
    assert passed_in_order(track, [Point(*spot) for spot in spots], WITHIN) == len(spots)
    assert left == sorted(left, reverse=True)
