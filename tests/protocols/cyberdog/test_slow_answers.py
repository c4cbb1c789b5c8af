"""A slow network: the answer comes as late as the fault says, in robot time."""

import asyncio

from roboglot.model.clock import LockstepClock
from roboglot.simulation.world.world import World
from tests.drivers.settling import late


async def test_answers_come_late(client, world: World, clock: LockstepClock) -> None:
    world.faults.inject("slow_answers", "a", seconds=3.0)
    answer = asyncio.ensure_future(client.raw(10001, "{}"))
    [(code, _)] = await late(answer, 3.0, clock)
    assert code == 10001
