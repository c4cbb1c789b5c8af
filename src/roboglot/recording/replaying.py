"""Sends the requests of a recording to a robot again, in order and at their times, and collects the answers."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from roboglot.clients.errors import ClientError, LinkLost
from roboglot.model.clock import Clock
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.comparing.ids import IDS_MAX, NO_ID, Id, id_of, with_ids
from roboglot.recording.comparing.trees import leaves, tree
from roboglot.recording.lines import Line, Target
from roboglot.recording.reader import AnsweredRequest, pair
from roboglot.recording.secrets import REDACTED


def sendable(exchanges: Sequence[Exchange]) -> tuple[list[Exchange], int]:
    """Return a session without redacted requests and their answers, and the number of requests left out.

    Sent unchanged, they would name a robot's Wi-Fi or a person "[redacted]".
    """
    asked, _ = pair(exchanges)
    held = [one for one in asked if REDACTED in one.request.payload]
    left = {id(exchange) for one in held for exchange in (one.request, *one.replies)}
    return [exchange for exchange in exchanges if id(exchange) not in left], len(held)


class Replay:
    """One replay; ``run`` returns the session with the robot at ``target``."""

    def __init__(self, recorded: Sequence[Exchange], target: Target, clock: Clock, *, fast: bool = False) -> None:
        self._asked = [asked for asked in pair(sendable(recorded)[0])[0] if asked.request.door == target.door]
        self._turns = [asyncio.Event() for _ in range(len(self._asked) + 1)]  # by number of the request
        self._target, self._clock, self._fast = target, clock, fast
        self._found: list[Exchange] = []
        self._ids: dict[Id, str] = {}
        self._started = 0.0
        self._answered = False
        self._lost: LinkLost | None = None

    async def run(self) -> list[Exchange]:
        """Run the replay and return the new session. Raises ClientError if the robot was never reached."""
        self._started = self._clock.time()
        self._turns[0].set()
        if self._fast:
            await self._one_line(list(enumerate(self._asked)))
        else:
            lines: dict[str, list[tuple[int, AnsweredRequest]]] = {}
            for number, asked in enumerate(self._asked):
                lines.setdefault(asked.request.connection, []).append((number, asked))
            async with asyncio.TaskGroup() as tasks:
                for mine in lines.values():
                    tasks.create_task(self._one_line(mine))
        if self._lost and not self._answered:  # an absent robot has no session
            raise self._lost
        return sorted(self._found, key=lambda exchange: exchange.stamp)

    async def _one_line(self, mine: Sequence[tuple[int, AnsweredRequest]]) -> None:
        """Send the requests of one connection, with their numbers in the session."""
        if not mine:
            return
        first = self._asked[0].request.stamp
        begin = mine[0][1].request
        line = self._target.line(self._clock, lambda op, data: self._note(begin.connection, Direction.PUSH, op, data))
        if not self._fast:
            await self._clock.sleep_until(self._started + begin.stamp - first)
        await line.open()
        try:
            for number, asked in mine:
                if not self._fast:
                    await self._clock.sleep_until(self._started + asked.request.stamp - first)
                await self._turns[number].wait()  # none overtakes a request of another connection
                self._turns[number + 1].set()
                await self._ask(line, asked)
        finally:
            await line.close()

    async def _ask(self, line: Line, asked: AnsweredRequest) -> None:
        request = asked.request
        self._note(request.connection, Direction.REQUEST, request.operation, request.payload)
        began = self._clock.time()
        try:
            recorded = [reply.payload for reply in asked.replies]
            answers = await line.request(request.operation, self._renamed(request.payload), recorded)
        except ClientError as error:
            if isinstance(error, LinkLost):
                self._lost = self._lost or error
            self._note(request.connection, Direction.REPLY, request.operation, b"", error.status, began, str(error))
            return
        self._answered = self._answered or bool(answers)
        for payload, status in answers:
            self._note(request.connection, Direction.REPLY, request.operation, payload, status, began)
        for reply, (payload, _) in zip(asked.replies, answers, strict=False):
            self._learn(reply.payload, payload)

    def _note(
        self,
        connection: str,
        direction: Direction,
        operation: str,
        payload: bytes,
        status: str = "",
        began: float | None = None,
        refusal: str = "",
    ) -> None:
        now = self._clock.time()
        seconds = 0.0 if began is None else now - began
        door = self._target.door
        self._found.append(
            Exchange(now, "replay", door, connection, "", direction, operation, payload, status, refusal, seconds)
        )

    # -- ids given by the robot --

    def _learn(self, recorded: bytes, live: bytes) -> None:
        """Remember the robot's new ids for the recorded ones: the newest, as it may give one again."""
        now: dict[str, object] = dict(leaves(tree(live)))
        for path, value in leaves(tree(recorded)):
            old, new = id_of(path, value), id_of(path, now.get(path))
            if NO_ID not in (old, new) and (old in self._ids or len(self._ids) < IDS_MAX):
                self._ids[old] = str(now[path])

    def _renamed(self, payload: bytes) -> bytes:
        return with_ids(payload, self._ids, head=self._target.door == "slamware")
