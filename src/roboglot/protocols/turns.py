"""Turns of clients' requests: a client beyond its share of the thread waits, except to stop a robot.

Knows no protocol: the door's ``stops`` returns whether a waiting request is one to stop.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from functools import partial
from typing import TypeVar

from roboglot.model.inputs.fairness import Fairness, Use
from roboglot.model.inputs.metering import metered
from roboglot.model.robot import Robot
from roboglot.transport.limiter import pay

T = TypeVar("T")


async def wait_for_turn(fairness: Fairness, use: Use, stops: Callable[[], bool]) -> None:
    """Wait for the turn of one request; the client's other requests are not delayed by it."""
    while (seconds := fairness.wait(use)) and not (stops() and fairness.hurries(use)):
        await pay(seconds)


class Turns:
    """Turns of one client, whose requests are answered in order."""

    def __init__(self, robot: Robot, peer: str) -> None:
        """``peer``: the client's host and port."""
        self._robot, self._peer = robot, peer
        self._news = asyncio.Event()

    def look(self) -> None:
        """Evaluate ``stops`` again, as another request came."""
        self._news.set()

    async def take(self, stops: Callable[[], bool]) -> None:
        """Wait for the next turn, but not while ``stops``."""
        if (fairness := self._robot.fairness) is None:
            return
        use = fairness.of(self._peer)
        while (seconds := fairness.wait(use)) and not (stops() and fairness.hurries(use)):
            self._news.clear()
            end = asyncio.get_running_loop().call_later(seconds, self._news.set)
            try:
                await self._news.wait()
            finally:
                end.cancel()

    async def count(self, work: Coroutine[object, None, T]) -> T:
        """Run ``work`` for a request, and charge its time to the client."""
        if (fairness := self._robot.fairness) is None:
            return await work
        return await metered(work, partial(fairness.took, fairness.of(self._peer)))
