"""A slow network: the reply comes as late as the fault says, in robot time."""

import asyncio

from roboglot.model.clock import LockstepClock
from roboglot.simulation.world.world import World
from tests.drivers.pace import settle


async def test_replies_come_late(client, world: World, clock: LockstepClock) -> None:
    world.faults.inject("slow_answers", "a", seconds=3.0)
    reply = asyncio.ensure_future(client.ask("version;"))
    for _ in range(29):
        await settle()
        await clock.advance(0.1)
    assert not reply.done()
    for _ in range(200):
        await settle()
        await clock.advance(0.1)
        if reply.done():
            break
    assert (await reply).startswith("version")
