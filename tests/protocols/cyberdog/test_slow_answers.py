"""Slow networks and slow apps: answers come late, and whole."""

import asyncio
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.protocols.cyberdog.service import Service
from roboglot.simulation.world.world import World
from tests.drivers.settling import late


async def test_answers_come_late(client, world: World, clock: LockstepClock) -> None:
    world.faults.inject("slow_answers", "a", seconds=3.0)
    answer = asyncio.ensure_future(client.raw(10001, "{}"))
    [(code, _)] = await late(answer, 3.0, clock)
    assert code == 10001


class SlowCall:
    """A call whose client takes a message only when it is ``free``."""

    def __init__(self) -> None:
        self.taken: list[object] = []
        self.begun, self.free = asyncio.Event(), asyncio.Event()

    async def write(self, message: object) -> None:
        """Wait for the client."""
        self.begun.set()
        await self.free.wait()
        self.taken.append(message)


async def test_a_call_that_ends_finishes_its_message() -> None:
    context: Any = SimpleNamespace(robot=SimpleNamespace(clock=SimpleNamespace(holding=nullcontext)))
    unused: Any = None
    rpc: Any = SlowCall()
    writing = asyncio.ensure_future(Service(context, unused)._write(rpc, "accepted"))
    await rpc.begun.wait()
    writing.cancel()  # its client lost a right, or its time is over: one more message says so
    await asyncio.sleep(0)
    assert not writing.done()
    rpc.free.set()
    with pytest.raises(asyncio.CancelledError):
        await writing
    assert rpc.taken == ["accepted"]
