"""Gives a lockstep world the recorded inputs once more, each at exactly its robot time, in the recorded order.

Inputs are requests at the doors, and what came from outside in another way: see ``model/inputs/outside.py``.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping, Sequence

from roboglot.clients.errors import ClientError
from roboglot.model.clock import LockstepClock, RealClock
from roboglot.model.inputs.outside import ANSWER, Input
from roboglot.model.tap import DRIVER, Direction, Exchange
from roboglot.recording.lines import FrameLine, Line, TextLine
from roboglot.recording.reader import Asked, Recording, pair

HEARD_SECONDS_MAX = 5.0  # real s to wait for a request to arrive, or for an answer that needs no robot time
LOOK = 0.0005  # real s between two checks
HANDED_ON = ("ipv4:", "ipv6:", "unix:")  # prefixes of the names of gRPC connections
AT_ONCE = 1e-9  # s of robot time
Where = Callable[[str, str], Line]  # robot and door
Repeat = Callable[[Input], Awaitable[object]]


def is_of_client(exchange: Exchange) -> bool:
    """Return whether a client said or heard it: no driver, no frame that a dog's door handed on, for that is asked."""
    return not exchange.door.startswith(DRIVER) and not (
        exchange.door == "visual" and exchange.connection.startswith(HANDED_ON)
    )


class Inputs:
    """Plays the inputs of a recording.

    ``where`` returns a new connection to a robot's door, not yet open; ``repeat`` does what one other input says.
    """

    def __init__(self, recording: Recording, clock: LockstepClock, where: Where, repeat: Repeat) -> None:
        self._clock, self._where, self._repeat = clock, where, repeat
        asked = [one for one in pair(recording.exchanges)[0] if is_of_client(one.request)]
        due: list[tuple[int, Asked | Input]] = [*recording.inputs, *((one.number, one) for one in asked)]
        self._due = sorted(due, key=lambda one: one[0])  # an input precedes the exchange with the same number
        replies = enumerate(recording.exchanges)
        self._replies = [(n, one) for n, one in replies if one.direction is Direction.REPLY and is_of_client(one)]
        self._answered = 0  # exchanges that should have been heard so far
        self._wanted: Counter[tuple[str, str, Direction]] = Counter()
        self._lines: dict[tuple[str, str, str], Line] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._heard: Counter[tuple[str, str, Direction]] = Counter()
        self._inputs: Counter[str] = Counter()
        self._patience = HEARD_SECONDS_MAX
        self.unheard: list[str] = []  # inputs without effect, described

    def hear(self, exchange: Exchange) -> None:
        """Listen to the robots' taps with this."""
        self._heard[exchange.robot, exchange.door, exchange.direction] += 1

    async def play(self, until: float) -> None:
        """Send all of it, let robot time pass until then, and hang up."""
        try:
            for place, (number, due) in enumerate(self._due, 1):
                at = due if isinstance(due, Input) else due.request
                if at.stamp > until:
                    break
                await self._clock.advance_to(max(self._clock.time(), at.stamp), at.turn)
                await self._catch_up(number)
                await (self._give(due) if isinstance(due, Input) else self._send(due, self._due[place : place + 1]))
            await self._clock.advance_to(max(self._clock.time(), until))
        finally:
            for task in self._tasks:
                task.cancel()
            for line in self._lines.values():
                with contextlib.suppress(ClientError, OSError):
                    await line.close()

    async def _catch_up(self, number: int) -> None:
        """Wait for replies that were heard before the exchange with this number, however long the machine takes."""
        while self._answered < len(self._replies) and self._replies[self._answered][0] < number:
            _, reply = self._replies[self._answered]
            self._answered += 1
            self._wanted[reply.robot, reply.door, Direction.REPLY] += 1
        if not await self._wait_for(self._wanted):
            self._patience = LOOK

    async def _give(self, given: Input) -> None:
        """Give an input that is no request."""
        if given.kind != ANSWER:  # it may take robot time
            self._follow(self._repeat(given))
            return
        deadline = time.monotonic() + self._patience  # noqa: TID251 - robot time stands still
        while not await self._repeat(given):
            if time.monotonic() > deadline:  # noqa: TID251
                self._patience = LOOK  # later inputs will differ as well
                self.unheard.append(f"{given.robot} was not waiting for an answer to {given.name} at {given.stamp:.3f}")
                return
            await asyncio.sleep(LOOK)  # noqa: TID251

    async def _send(self, asked: Asked, following: Sequence[tuple[int, Asked | Input]]) -> None:
        """Send a request, and wait for what is answered at once, before the ``following`` input."""
        request = asked.request
        end = following[0][0] if following else math.inf
        place = request.robot, request.door
        requests, replies = self._heard[*place, Direction.REQUEST], self._heard[*place, Direction.REPLY]
        at_once = sum(n < end and reply.stamp - request.stamp <= AT_ONCE for n, reply in asked.numbered)
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
        deadline = time.monotonic() + self._patience  # noqa: TID251 - robot time stands still
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

    def _follow(self, work: Awaitable[object]) -> None:
        async def quietly() -> None:
            with contextlib.suppress(ClientError, OSError):
                await work

        task = asyncio.get_running_loop().create_task(quietly())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
