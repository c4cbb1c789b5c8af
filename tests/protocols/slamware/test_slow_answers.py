"""A slow network: the answer comes as late as the fault says, in robot time."""

import asyncio

import httpx

from roboglot.model.clock import LockstepClock
from roboglot.simulation.world.world import World
from tests.drivers.settling import late


async def test_answers_come_late(client: httpx.AsyncClient, world: World, clock: LockstepClock) -> None:
    world.faults.inject("slow_answers", "a", seconds=3.0)
    answer = asyncio.ensure_future(client.get("/api/core/system/v1/power/status"))
    assert (await late(answer, 3.0, clock)).status_code == 200
