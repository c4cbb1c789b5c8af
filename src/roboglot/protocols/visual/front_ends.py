"""All front ends of a robot, over any carrier. Knows answers and reports, but no request."""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable, Mapping, Sequence

from roboglot.model.response_delay import response_delay
from roboglot.model.robot import Robot
from roboglot.wire.visual.relay import FrontEnd
from roboglot.wire.visual.replies import responses

log = logging.getLogger(__name__)

FRONT_ENDS_MAX = 64


async def _always_room() -> None:
    """Return at once."""


class Plain:
    """A front end that takes frames of any length, and sends answers and reports in the same way."""

    longest = 0

    def __init__(self, send: Callable[[str], None], drain: Callable[[], Awaitable[None]] = _always_room) -> None:
        self.answer = self.publish = send
        self._drain = drain

    async def drain(self) -> None:
        """Wait until the front end has caught up."""
        await self._drain()


class FrontEnds:
    """Sends frames to all front ends, after the simulated delay of the network."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._all: list[FrontEnd] = []
        self._delayed = 0  # frames that the network delays
        self._due = 0.0  # robot time at which the last of them arrives

    def add(self, front_end: FrontEnd) -> Callable[[], None]:
        """Add a front end; return a function that removes it. Raises RuntimeError if there are too many."""
        if len(self._all) >= FRONT_ENDS_MAX:
            raise RuntimeError(f"more than {FRONT_ENDS_MAX} front ends")
        self._all.append(front_end)
        return lambda: self._all.remove(front_end) if front_end in self._all else None

    def clear(self) -> None:
        """Remove all front ends."""
        self._all.clear()

    def answer(self, text: str) -> None:
        """Send the answer to a request."""
        self._each(lambda front_end: front_end.answer(text))

    def publish(self, text: str) -> None:
        """Send a report of a task."""
        self._each(lambda front_end: front_end.publish(text))

    def answer_list(self, kind: str, id: str, items: Sequence[Mapping[str, object]]) -> None:
        """Send a list, in as many frames as each front end needs."""
        split: dict[int, list[str]] = {}

        def give(front_end: FrontEnd) -> None:
            longest = front_end.longest
            if longest not in split:
                split[longest] = responses(kind=kind, id=id, items=items, longest=longest)
            for text in split[longest]:
                front_end.answer(text)

        self._each(give)

    async def drain(self) -> None:
        """Wait until every front end has caught up."""
        for front_end in tuple(self._all):
            await front_end.drain()

    def _each(self, give: Callable[[FrontEnd], None]) -> None:
        """Give a frame once the network lets it pass; none overtakes those before it when the network gets faster."""
        clock = self._robot.clock
        now = clock.time()
        due = max(now + response_delay(self._robot), self._due)
        if not self._delayed and due <= now:
            self._give(give)
            return
        self._delayed += 1
        self._due = due
        clock.call_at(due, lambda: self._give_late(give))

    def _give_late(self, give: Callable[[FrontEnd], None]) -> None:
        self._delayed -= 1
        self._give(give)

    def _give(self, give: Callable[[FrontEnd], None]) -> None:
        for front_end in tuple(self._all):
            try:
                give(front_end)
            except Exception:
                log.exception("cannot pass a frame to a front end")
