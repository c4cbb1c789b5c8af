"""Sends the recorded requests to a lockstep world once more, each at exactly its robot time, in the recorded order."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from roboglot.clients.errors import ClientError
from roboglot.model.clock import LockstepClock, RealClock
from roboglot.model.tap import DRIVER, Direction, Exchange
from roboglot.recording.lines import FrameLine, Line, TextLine
from roboglot.recording.reader import Asked, pair

HEARD_SECONDS_MAX = 5.0  # real, until a request must have come in, or an answer that needs no robot time
LOOK = 0.0005  # real s between two looks
HANDED_ON = ("ipv4:", "ipv6:", "unix:")  # with which the names of gRPC's connections begin
AT_ONCE = 1e-9  # s of robot time
Where = Callable[[str, str], Line]  # robot and door


def of_clients(exchanges: Sequence[Exchange]) -> Sequence[Exchange]:
    """Return what clients said and heard: no drivers, and no frames that a dog's door handed on, for it is asked."""
    return [
        exchange
        for exchange in exchanges
        if not exchange.door.startswith(DRIVER)
        and not (exchange.door == "visual" and exchange.connection.startswith(HANDED_ON))
    ]


class Inputs:
    """Plays the requests of a recording. ``where`` returns a new connection to a robot's door, not yet open."""

    def __init__(self, exchanges: Sequence[Exchange], clock: LockstepClock, where: Where) -> None:
        self._asked, self._clock, self._where = pair(of_clients(exchanges))[0], clock, where
        self._lines: dict[tuple[str, str, str], Line] = {}
        self._tasks: set[asyncio.Task[object]] = set()
        self._heard: Counter[tuple[str, str, Direction]] = Counter()
        self.unheard: list[str] = []  # requests that did not come in, in words

    def hear(self, exchange: Exchange) -> None:
        """Listen to the robots' taps with this."""
        self._heard[exchange.robot, exchange.door, exchange.direction] += 1

    async def play(self, until: float) -> None:
        """Send all of it, let robot time pass until then, and hang up."""
        try:
            for asked in self._asked:
                if asked.request.stamp > until:
                    break
                await self._clock.advance_to(max(self._clock.time(), asked.request.stamp))
                await self._send(asked)
            await self._clock.advance_to(max(self._clock.time(), until))
        finally:
            for task in self._tasks:
                task.cancel()
            for line in self._lines.values():
                with contextlib.suppress(ClientError, OSError):
                    await line.close()

    async def _send(self, asked: Asked) -> None:
        request = asked.request
        place = request.robot, request.door
        requests, replies = self._heard[*place, Direction.REQUEST], self._heard[*place, Direction.REPLY]
        at_once = sum(reply.stamp - request.stamp <= AT_ONCE for reply in asked.replies)
        try:
            line = await self._line(request)
            answers = 0 if isinstance(line, (TextLine, FrameLine)) else len(asked.replies)
            self._follow(line.ask(request.operation, request.payload, answers))
        except ClientError as error:
            self.unheard.append(f"{request.operation}: {error}")
            return
        wanted = {(*place, Direction.REQUEST): requests + 1, (*place, Direction.REPLY): replies + at_once}
        if not await self._wait_for(wanted):
            self.unheard.append(f"{request.operation} at {request.stamp:.3f}")

    async def _wait_for(self, wanted: Mapping[tuple[str, str, Direction], int]) -> bool:
        deadline = time.monotonic() + HEARD_SECONDS_MAX  # noqa: TID251 - robot time stands still
        while any(self._heard[key] < count for key, count in wanted.items()):
            if time.monotonic() > deadline:  # noqa: TID251
                return False
            await asyncio.sleep(LOOK)  # noqa: TID251
        return True

    async def _line(self, request: Exchange) -> Line:
        key = request.robot, request.door, request.connection
        if (line := self._lines.get(key)) is None:
            line = self._lines[key] = self._where(request.robot, request.door)
            line.clock = RealClock()
            await line.open()
            if isinstance(line, (TextLine, FrameLine)):
                self._follow(line.drain())
        return line

    def _follow(self, coroutine: Any) -> None:
        async def quietly() -> None:
            with contextlib.suppress(ClientError, OSError):
                await coroutine

        task = asyncio.get_running_loop().create_task(quietly())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
