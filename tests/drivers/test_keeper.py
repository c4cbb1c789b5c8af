"""A robot that is away is tried again after longer and longer pauses; one that was there, soon."""

import asyncio
from itertools import pairwise

from roboglot.clients.errors import LinkLost
from roboglot.drivers.keeper import Keeper
from roboglot.model.clock import LockstepClock
from roboglot.model.components.health import Health
from roboglot.model.components.link import Link, LinkState
from roboglot.model.robot import Description, Robot

SERVED = 1.0  # s until it is gone again
FIRST_THERE = 7  # the try, from 0, that finds it; no other does
NOBODY = Description(maker="", model="", serial="", hardware_version="", software_version="", radius=0.25, height=0.3)


async def test_pauses_grow_up_to_ten_seconds_and_begin_anew_after_a_connection(clock: LockstepClock) -> None:
    robot = Robot("a", NOBODY, clock)
    link = Link("ep://away", clock, robot.events, Health(clock, robot.events))
    tried: list[float] = []

    async def begin() -> None:
        tried.append(clock.time())
        if len(tried) - 1 != FIRST_THERE:
            raise LinkLost("nobody there")

    async def serve() -> None:
        await clock.sleep(SERVED)
        raise LinkLost("it left")

    async def stop() -> None:
        """It cannot be told."""

    keeper = Keeper(link, clock, begin, serve)
    keeper.start()
    states = set()
    for _ in range(200):
        await clock.advance(0.25)
        await asyncio.sleep(0)
        states.add(link.state)
    await keeper.close(stop())
    pauses = [round(after - before, 2) for before, after in pairwise(tried)]
    assert pauses[:11] == [0.5, 1.0, 2.0, 4.0, 8.0, 10.0, 10.0, SERVED + 0.5, 1.0, 2.0, 4.0]
    assert states == {LinkState.CONNECTING, LinkState.UP, LinkState.LOST}
    assert link.state is LinkState.CLOSED
