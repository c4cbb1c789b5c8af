"""Queue of a run's events for its one reader; consecutive output is joined. Knows no process."""

from __future__ import annotations

import asyncio
from collections import deque

from roboglot.programs.engine.events import Event, Output

EVENTS_MAX = 256
"""Events kept for a slow reader before the worker has to wait."""
OUTPUT_EVENT_MAX = 64 * 1024
"""Most characters of joined output in one event."""
OUTPUT_MAX = 4 * OUTPUT_EVENT_MAX
"""Characters of output kept for a slow reader before the worker has to wait."""


class EventQueue:
    """A queue that never blocks its writer: the writer should pause while ``full``."""

    __slots__ = ("_events", "_loop", "_pieces", "_size", "_unread", "closed", "reader")

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._events: deque[Event] = deque()
        self._pieces: list[str] = []
        self._size = self._unread = 0
        self.reader: asyncio.Future[None] | None = None  # the waiting reader; a future is cheaper than an Event
        self.closed = False

    @property
    def full(self) -> bool:
        """True if the writer should wait."""
        return len(self._events) >= EVENTS_MAX or self._unread >= OUTPUT_MAX

    def write(self, text: str) -> None:
        """Add output."""
        if not text:
            return
        if self._pieces and self._size + len(text) > OUTPUT_EVENT_MAX:
            self._join()
        self._pieces.append(text)
        self._size += len(text)
        self._unread += len(text)
        self._wake()

    def put(self, event: Event) -> None:
        """Add any other event."""
        if self._pieces:
            self._join()
        self._events.append(event)
        self._wake()

    def drop(self) -> None:
        """Discard all events."""
        self._events.clear()
        self._pieces.clear()
        self._size = self._unread = 0

    def close(self) -> None:
        """End the queue: nothing more will come."""
        self.closed = True
        self._wake()

    async def take(self) -> Event | None:
        """Return the next event; None when closed and empty."""
        while not self._events:
            if self._pieces:
                self._join()
                break
            if self.closed:
                return None
            self.reader = self._loop.create_future()
            await self.reader
        event = self._events.popleft()
        if isinstance(event, Output):
            self._unread -= len(event.text)
        return event

    def _wake(self) -> None:
        if self.reader is not None and not self.reader.done():
            self.reader.set_result(None)

    def _join(self) -> None:
        self._events.append(Output("".join(self._pieces)))
        self._pieces.clear()
        self._size = 0
