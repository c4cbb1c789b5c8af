"""Turns of clients' requests: one beyond its share of the thread waits, but not with a request to stop a robot.

Knows no protocol: ``stops`` is a door's way to tell whether a request that waits is one to stop.
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
    """Wait until a request of a client may be answered; its others are not delayed by this one."""
    while (seconds := fairness.wait(use)) and not (stops() and fairness.hurries(use)):
        await pay(seconds)


class Turns:
    """The turns of one client, whose requests are answered in order."""

    def __init__(self, robot: Robot, peer: str) -> None:
        """``peer``: the client's host and port."""
        self._robot, self._peer = robot, peer
        self._news = asyncio.Event()

    def look(self) -> None:
        """Ask ``stops`` of a turn that waits once more: another request came."""
        self._news.set()

    async def take(self, stops: Callable[[], bool]) -> None:
        """Wait for the next turn; not while a request that waits is one to stop."""
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
        """Do what a request asks for; the time that it takes counts."""
        if (fairness := self._robot.fairness) is None:
            return await work
        return await metered(work, partial(fairness.took, fairness.of(self._peer)))
