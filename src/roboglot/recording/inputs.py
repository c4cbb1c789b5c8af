"""Replays recorded inputs to a lockstep world, each at exactly its robot time, in the recorded order.

Inputs are requests at the doors, clients that connect and hang up, and other external inputs: see
``model/inputs/external.py``.
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
from roboglot.model.inputs import external
from roboglot.model.inputs.external import Input
from roboglot.model.tap import DRIVER, Direction, Exchange
from roboglot.recording.lines import FoxgloveLine, FrameLine, Line, TextLine
from roboglot.recording.reader import AnsweredRequest, Recording, pair

HEARD_SECONDS_MAX = 5.0  # real s to wait for a request to arrive, or for an answer that needs no robot time
LOOK = 0.0005  # real s between two checks
HANDED_ON = ("ipv4:", "ipv6:", "unix:")  # prefixes of the names of gRPC connections
AT_ONCE = 1e-9  # s of robot time
DRAINED = (TextLine, FrameLine, FoxgloveLine)  # connections whose answers are read, but not waited for
Place = tuple[str, str, str]  # robot, door, the client's end
Where = Callable[[Place], Line | None]
Key = tuple[str, str, str]  # robot, door or name, direction or kind
Repeat = Callable[[Input], Awaitable[object]]


def is_of_client(exchange: Exchange) -> bool:
    """Return whether a client sent or received it: no driver's exchange, no frame passed on by a dog's door."""
    return not exchange.door.startswith(DRIVER) and not (
        exchange.door == "visual" and exchange.connection.startswith(HANDED_ON)
    )


class Inputs:
    """Plays the inputs of a recording.

    ``where`` returns a new connection to a robot's door, not yet open, like the recorded client's; None if there can be
    none. ``repeat`` applies one input of another kind.
    """

    def __init__(self, recording: Recording, clock: LockstepClock, where: Where, repeat: Repeat) -> None:
        self._clock, self._where, self._repeat = clock, where, repeat
        asked = [one for one in pair(recording.exchanges)[0] if is_of_client(one.request)]
        due: list[tuple[int, AnsweredRequest | Input]] = [*recording.inputs, *((one.number, one) for one in asked)]
        self._due = sorted(due, key=lambda one: one[0])  # an input precedes the exchange with the same number
        replies = enumerate(recording.exchanges)
        self._replies = [(n, one) for n, one in replies if one.direction is Direction.REPLY and is_of_client(one)]
        self._answered = 0  # exchanges expected so far
        self._wanted: Counter[Key] = Counter()
        self._lines: dict[Place, Line] = {}
        self._calls: dict[tuple[Place, str, float], asyncio.Task[None]] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._heard: Counter[Key] = Counter()
        self._wanted_inputs: Counter[Key] = Counter()
        self._wait_max = HEARD_SECONDS_MAX
        self.unheard: list[str] = []  # inputs without effect, described

    def count(self, exchange: Exchange) -> None:
        """Count an exchange; a listener for the robots' taps."""
        self._heard[exchange.robot, exchange.door, exchange.direction] += 1

    def notice(self, given: Input) -> None:
        """Count an input; a listener for the robots' inputs."""
        self._heard[given.robot, given.name, given.kind] += 1

    async def play(self, until: float) -> None:
        """Replay inputs, and let time pass, up to robot time ``until`` (s). Clients stay connected until ``close``."""
        for place, (number, due) in enumerate(self._due, 1):
            at = due if isinstance(due, Input) else due.request
            if at.stamp > until:
                break
            await self._clock.advance_to(max(self._clock.time(), at.stamp), at.turn)
            await self._catch_up(number)
            await (self._give(due) if isinstance(due, Input) else self._send(due, self._due[place : place + 1]))
        await self._clock.advance_to(max(self._clock.time(), until))

    async def close(self) -> None:
        """Hang up, and cancel unanswered requests."""
        for task in self._tasks:
            task.cancel()
        for line in self._lines.values():
            await _quietly(line.close())

    async def _catch_up(self, number: int) -> None:
        """Wait for the replies recorded before the exchange with this number, however long the machine takes."""
        while self._answered < len(self._replies) and self._replies[self._answered][0] < number:
            _, reply = self._replies[self._answered]
            self._answered += 1
            self._wanted[reply.robot, reply.door, Direction.REPLY] += 1
        if not await self._wait_for(self._wanted):
            self._wait_max = LOOK

    async def _give(self, given: Input) -> None:
        """Apply an input that is not a request."""
        match given.kind:
            case external.ANSWER:
                if not await self._wait_until(lambda: self._repeat(given)):
                    self._wait_max = LOOK  # later inputs will differ as well
                    self._miss(f"{given.robot} was not waiting for an answer to {given.name}", given.stamp)
            case external.CAME:
                path = str(given.values.get("path", ""))
                await self._line((given.robot, given.name, given.connection), path, given.stamp)
            case external.GONE:
                line = self._lines.pop((given.robot, given.name, given.connection), None)
                if line is not None:
                    self._follow(line.close())
                    await self._see(given)
            case external.CALLED_OFF:
                place = given.robot, given.name, given.connection
                code, began = given.values.get("operation"), given.values.get("asked")
                called = place, str(code), began if isinstance(began, float) else 0.0
                if (call := self._calls.pop(called, None)) is not None:
                    call.cancel()
                    await self._see(given)
            case _:
                self._follow(self._repeat(given))  # it may take robot time

    async def _see(self, given: Input) -> None:
        """Wait until the robot has noticed an action of a client."""
        key = given.robot, given.name, given.kind
        self._wanted_inputs[key] += 1
        if not await self._wait_for({key: self._wanted_inputs[key]}):
            self._miss(f"a client of {given.name} that has {given.kind}", given.stamp)

    def _miss(self, what: str, stamp: float) -> None:
        self.unheard.append(f"{what} at {stamp:.3f}")

    async def _send(self, asked: AnsweredRequest, following: Sequence[tuple[int, AnsweredRequest | Input]]) -> None:
        """Send a request, and wait for the answers that were recorded before the ``following`` input."""
        request = asked.request
        end = following[0][0] if following else math.inf
        robot, door = request.robot, request.door
        requests, replies = self._heard[robot, door, Direction.REQUEST], self._heard[robot, door, Direction.REPLY]
        at_once = sum(n < end and reply.stamp - request.stamp <= AT_ONCE for n, reply in asked.numbered)
        place = robot, door, request.connection
        line = await self._line(place, request.operation, request.stamp)
        if line is None:
            return
        answers = () if isinstance(line, DRAINED) else [reply.payload for reply in asked.replies]
        call = self._follow(line.request(request.operation, request.payload, answers))
        self._calls[place, request.operation, request.stamp] = call
        wanted: dict[Key, int] = {(robot, door, Direction.REQUEST): requests + 1}
        wanted[robot, door, Direction.REPLY] = replies + at_once
        if not await self._wait_for(wanted):
            self._miss(request.operation or f"a message of {door}", request.stamp)

    async def _wait_for(self, wanted: Mapping[Key, int]) -> bool:
        async def heard() -> bool:
            return all(self._heard[key] >= count for key, count in wanted.items())

        return await self._wait_until(heard)

    async def _wait_until(self, done: Callable[[], Awaitable[object]]) -> bool:
        deadline = time.monotonic() + self._wait_max  # noqa: TID251 - robot time stands still
        while not await done():
            if time.monotonic() > deadline:  # noqa: TID251
                return False
            await asyncio.sleep(LOOK)  # noqa: TID251
        return True

    async def _line(self, place: Place, path: str, stamp: float) -> Line | None:
        """Return a client's connection, opened if necessary; None if that is impossible."""
        if (line := self._lines.get(place)) is not None:
            return line
        robot, door, _ = place
        if (line := self._where(place)) is None:
            self._miss(f"a client of {door}, whose messages cannot be repeated,", stamp)
            return None
        line.clock = RealClock()
        if isinstance(line, FrameLine) and path.startswith("/"):
            line.path = path
        came = self._heard[robot, door, external.CAME]
        try:
            await line.open()
        except (ClientError, OSError) as error:
            self._miss(f"a client of {door} ({error})", stamp)
            return None
        self._lines[place] = line
        if isinstance(line, DRAINED):
            self._follow(line.drain())
        if isinstance(line, DRAINED) and line.comes:
            await self._wait_for({(robot, door, external.CAME): came + 1})
        return line

    def _follow(self, work: Awaitable[object]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(_quietly(work))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task


async def _quietly(work: Awaitable[object]) -> None:
    with contextlib.suppress(ClientError, OSError):
        await work
