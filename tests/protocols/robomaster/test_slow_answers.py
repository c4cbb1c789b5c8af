"""A slow network: the reply comes as late as the fault says, in robot time."""

import asyncio

from roboglot.model.clock import LockstepClock
from roboglot.simulation.world.world import World
from tests.drivers.settling import late


async def test_replies_come_late(client, world: World, clock: LockstepClock) -> None:
    world.faults.inject("slow_answers", "a", seconds=3.0)
    reply = asyncio.ensure_future(client.ask("version;"))
    assert (await late(reply, 3.0, clock)).startswith("version")
