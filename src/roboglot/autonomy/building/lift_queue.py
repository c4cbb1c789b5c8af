"""Queue of robots that want the lift: each claims a ticket by radio, and the lowest one goes next.

Robots without a radio do not queue: they see each other only in front of its door.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from roboglot.model.components.logistics.traffic_radio import TrafficRadio
from roboglot.model.errors import Expired
from roboglot.model.robot import Robot

TICKET = "lift "
TICKETS_MAX = 40  # robots that can wait
LOOK = 0.5  # s between two looks at the others' tickets
TURN_MAX = 1800.0  # s to wait for one's turn


class LiftQueue:
    """Place of one robot in the queue."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot

    @asynccontextmanager
    async def turn(self, make_way: Callable[[], Awaitable[None]]) -> AsyncIterator[None]:
        """Enter when it is this robot's turn, and let the next one go at the end. Raises Expired.

        ``make_way``: leaves the place in front of the door, for others that wait or come out.
        """
        if TrafficRadio not in self._robot:
            yield
            return
        clock, waits = self._robot.clock, False
        deadline = clock.time() + TURN_MAX
        while (ticket := max(self._tickets(), default=-1) + 1) >= TICKETS_MAX:
            self._check(deadline)
            await clock.sleep(LOOK)
        self._change(None, ticket)
        try:
            while lower := [other for other in self._tickets() if other < ticket]:
                self._change(ticket, max(lower) + 1)  # numbers stay small
                ticket = max(lower) + 1
                if not waits:
                    await make_way()
                waits = True
                self._check(deadline)
                await clock.sleep(LOOK)
            self._change(ticket, 0)
            ticket = 0
            yield
            if self._tickets():
                await make_way()
        finally:
            self._change(ticket, None)

    def _check(self, deadline: float) -> None:
        if self._robot.clock.time() > deadline:
            raise Expired(f"the turn in front of the lift did not come within {TURN_MAX:g} s")

    def _change(self, old: int | None, new: int | None) -> None:
        """Give a ticket back, or take one, or both."""
        radio = self._robot[TrafficRadio]
        claims = {f"{TICKET}{new}"} if new is not None else set[str]()
        radio.claim((radio.claims - {f"{TICKET}{old}"}) | claims)

    def _tickets(self) -> list[int]:
        """Return the numbers that others hold."""
        radio = self._robot[TrafficRadio]
        return [number for number in range(TICKETS_MAX) if radio.others(f"{TICKET}{number}")]
