"""Queue of robots that want the lift: each claims a ticket by radio, and the lowest one goes next.

A robot that makes no progress towards the car loses its turn to those who wait. Robots without a radio do not queue:
they see each other only in front of the lift's door.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.logistics.traffic_radio import TrafficRadio
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.errors import Expired
from roboglot.model.robot import Robot

TICKET = "lift "
TICKETS_MAX = 40  # robots that can wait
LOOK = 0.5  # s between two looks at the others' tickets
TURN_MAX = 1800.0  # s to wait for one's turn
STILL_MAX = 60.0  # s without progress after which a turn ends while others wait
MOVED = 0.2  # m that count as progress


class Turn:
    """Place of one robot in the queue, and its turn; ``make_way`` leaves the place in front of the door."""

    def __init__(self, robot: Robot, make_way: Callable[[], Awaitable[None]]) -> None:
        self._robot, self._clock, self._make_way = robot, robot.clock, make_way
        self._ticket: int | None = None  # 0: its turn
        self.aboard = False

    async def queue(self) -> None:
        """Return when it is this robot's turn. Raises Expired."""
        if TrafficRadio not in self._robot:
            return
        self._take(None)
        deadline, waits = self._clock.time() + TURN_MAX, False
        while (ticket := max(self._others(), default=-1) + 1) >= TICKETS_MAX:
            await self._wait(deadline)
        self._take(ticket)
        while lower := [other for other in self._others() if other < ticket]:
            ticket = max(lower) + 1  # numbers stay small
            self._take(ticket)
            if not waits:
                await self._make_way()
            waits = True
            await self._wait(deadline)
        self._take(0)

    def board(self) -> None:
        """Take the turn out of order: the robot is in the car."""
        self.aboard = True
        if TrafficRadio in self._robot:
            self._take(0)

    async def may_board(self) -> bool:
        """Return whether it is still this robot's turn, and the car empty; if not, return at its next turn."""
        if TrafficRadio in self._robot and (self._ticket is None or 0 in self._others()):
            await self.queue()
            return False
        self.aboard = True
        return True

    async def leave(self) -> None:
        """Leave the place in front of the door if others wait."""
        self.aboard = False
        if TrafficRadio in self._robot and self._ticket is not None and self._others():
            await self._make_way()

    def end(self) -> None:
        """End this robot's turn, so that the next one may ride."""
        if TrafficRadio in self._robot:
            self._take(None)

    async def watch(self) -> None:
        """End the turn when the robot made no progress for too long while others wait; runs until cancelled."""
        place, lift, since = self._robot[Localization].pose, self._robot[LiftClient].state, self._clock.time()
        while True:
            await self._clock.sleep(LOOK)
            now, pose, state = self._clock.time(), self._robot[Localization].pose, self._robot[LiftClient].state
            if self.aboard or self._ticket != 0 or state != lift or pose.distance_to(place) > MOVED:
                place, lift, since = pose, state, now
            elif now - since > STILL_MAX and self._others():
                self._take(None)

    async def _wait(self, deadline: float) -> None:
        if self._clock.time() > deadline:
            raise Expired(f"the turn in front of the lift did not come within {TURN_MAX:g} s")
        await self._clock.sleep(LOOK)

    def _take(self, ticket: int | None) -> None:
        """Claim ``ticket`` instead of the present one."""
        radio = self._robot[TrafficRadio]
        claims = {f"{TICKET}{ticket}"} if ticket is not None else set[str]()
        radio.claim((radio.claims - {f"{TICKET}{self._ticket}"}) | claims)
        self._ticket = ticket

    def _others(self) -> list[int]:
        """Return the numbers that others hold."""
        radio = self._robot[TrafficRadio]
        return [number for number in range(TICKETS_MAX) if radio.others(f"{TICKET}{number}")]


@asynccontextmanager
async def turn(robot: Robot, make_way: Callable[[], Awaitable[None]], *, aboard: bool = False) -> AsyncIterator[Turn]:
    """Enter when it is this robot's turn, and let the next one go at the end. Raises Expired.

    ``make_way``: leaves the place in front of the door, for others that wait or come out. ``aboard``: the robot is in
    the car already, so its ride comes before all turns.
    """
    mine = Turn(robot, make_way)
    watch: asyncio.Task[None] | None = None
    try:
        if aboard:
            mine.board()
        else:
            await mine.queue()
        if TrafficRadio in robot:
            watch = asyncio.ensure_future(mine.watch())
        yield mine
        await mine.leave()
    finally:
        if watch:
            watch.cancel()
        mine.end()
