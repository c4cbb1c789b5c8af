"""Chains of ``chassis move``: who is answered ok was driven there, by the truth; who was cut short is not."""

from __future__ import annotations

import asyncio
import math

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.geometry import Pose
from roboglot.simulation.world.world import World
from roboglot.testing import passed_in_order

pytestmark = pytest.mark.world("empty", body="robomaster_ep")
CHAIN = [(0.6, 0.0, 0), (0.0, -0.5, 0), (0.0, 0.5, 0), (-0.3, 0.0, 90), (0.4, 0.0, 0), (-0.4, 0.0, -90)]
WITHIN = 0.06  # m


async def test_a_chain_of_moves_passes_all_its_places(connect, world: World, clock: LockstepClock) -> None:
    client = await connect()
    assert await client.ask("command;") == "ok;"
    await clock.advance(0.5)
    start, here = world.truth.pose_of("a"), Pose()
    track, goals = [Pose()], []
    for x, y, z in CHAIN:
        # The text's y is to the right, its z clockwise.
        here = here.compose(Pose(x, -y, -math.radians(z)))
        goals.append(here.point)
        client.send(f"chassis move x {x} y {y} z {z} vxy 1 vz 120 wait_for_complete true;")
        waiting = asyncio.ensure_future(client.reply())
        while not waiting.done():
            await clock.advance(0.02)
            await asyncio.sleep(0)
            track.append(world.truth.pose_of("a").relative_to(start))
        assert waiting.result() == "ok;"
    assert passed_in_order(track, goals, WITHIN) == len(goals)


async def test_a_move_cut_short_by_the_next_fails(connect, world: World, clock: LockstepClock) -> None:
    first, second = await connect(), await connect()
    assert await first.ask("command;") == "ok;"
    start = world.truth.pose_of("a")
    first.send("chassis move x 2 vxy 0.5 wait_for_complete true;")
    await clock.advance(1.0)
    waiting = asyncio.ensure_future(first.reply())
    assert await second.ask("chassis move x -0.2;") == "ok;"
    for _ in range(200):
        await clock.advance(0.05)
        await asyncio.sleep(0)
        if waiting.done():
            break
    assert world.truth.pose_of("a").distance_to(start) < 1.9
    assert waiting.result() == "fail;"
