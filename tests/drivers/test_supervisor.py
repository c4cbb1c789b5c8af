"""A robot that is away is tried again after longer and longer pauses; one that was there, soon."""

import asyncio
from collections.abc import Collection
from contextlib import nullcontext
from itertools import pairwise

import pytest

from roboglot.clients.errors import LinkLost
from roboglot.drivers.supervisor import SENDING_MAX, STEADY, Supervisor
from roboglot.model.clock import LockstepClock
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.errors import Refused
from roboglot.model.robot import Description, Robot

SERVED, FLAPPING = STEADY + 1.0, 1.0  # s until it is gone again
FIRST_THERE = 7  # the attempt, from 0, that finds it
UNKNOWN = Description(maker="", model="", serial="", hardware_version="", software_version="", radius=0.25, height=0.3)


async def pauses_of(clock: LockstepClock, there: Collection[int], served: float) -> tuple[list[float], set[LinkState]]:
    """Pauses between attempts, of which those in ``there`` find it for ``served`` s; and the states meanwhile."""
    robot = Robot("a", UNKNOWN, clock)
    link = Link("ep://away", clock, robot.events, Health(clock, robot.events))
    tried: list[float] = []

    async def begin() -> None:
        tried.append(clock.time())
        if len(tried) - 1 not in there:
            raise LinkLost("no one there")

    async def serve() -> None:
        await clock.sleep(served)
        raise LinkLost("it left")

    async def stop() -> None:
        """Refuse commands."""

    supervisor = Supervisor(link, clock, begin, serve, nullcontext)
    supervisor.start()
    states = set()
    for _ in range(200):
        await clock.advance(0.25)
        await asyncio.sleep(0)
        states.add(link.state)
    await supervisor.close(stop())
    assert link.state is LinkState.CLOSED
    return [round(after - before, 2) for before, after in pairwise(tried)], states


async def test_pauses_grow_to_ten_seconds_until_a_connection(clock: LockstepClock) -> None:
    pauses, states = await pauses_of(clock, {FIRST_THERE}, SERVED)
    assert pauses[:11] == [0.5, 1.0, 2.0, 4.0, 8.0, 10.0, 10.0, SERVED + 0.5, 1.0, 2.0, 4.0]
    assert states == {LinkState.CONNECTING, LinkState.UP, LinkState.LOST}


async def test_link_that_flaps_is_tried_ever_more_seldom(clock: LockstepClock) -> None:
    pauses, _ = await pauses_of(clock, range(100), FLAPPING)
    assert pauses[:6] == [FLAPPING + pause for pause in (0.5, 1.0, 2.0, 4.0, 8.0, 10.0)]


async def test_full_link_refuses_all_but_stops(clock: LockstepClock) -> None:
    robot = Robot("a", UNKNOWN, clock)
    link = Link("ep://slow", clock, robot.events, Health(clock, robot.events))
    answered, sent = asyncio.Event(), []

    async def command(name: str) -> None:
        sent.append(name)
        await answered.wait()

    async def nothing() -> None:
        """Succeed at once."""

    async def serve() -> None:
        await answered.wait()

    supervisor = Supervisor(link, clock, nothing, serve, nullcontext)
    supervisor.start()
    await supervisor.first_try()
    for number in range(SENDING_MAX):
        supervisor.send("a light", command(f"light {number}"))
    with pytest.raises(Refused, match="pending"):
        supervisor.send("a light", command("one light too many"))
    supervisor.send("emergency stop", command("stop"), always=True)
    await asyncio.sleep(0)
    assert sent == [*(f"light {number}" for number in range(SENDING_MAX)), "stop"]
    answered.set()
    await supervisor.close(nothing())
