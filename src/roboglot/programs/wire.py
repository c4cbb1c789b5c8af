"""The loop's end of a worker's socket. Knows frames and their rate, not their contents. Time here is the machine's."""

from __future__ import annotations

import asyncio
from typing import Protocol, cast

from roboglot.programs.messages import ProtocolViolation
from roboglot.programs.worker.frames import FrameReader, FrameTooLong

FRAME_RATE_MAX = 10_000
"""Frames a second, printing included, that a worker is listened to; a faster one has to wait."""
_BURST = 0.1
"""Seconds worth of frames that may come at once before the rate is held."""


class Listener(Protocol):
    """What a wire talks to."""

    def take(self, body: bytes) -> bool:
        """One frame; False when no more frames matter. Raises ProtocolViolation."""

    @property
    def full(self) -> bool:
        """Whether reading should pause until ``read_on``."""

    @property
    def hold(self) -> float:
        """Seconds that reading should pause for, because this worker has taken too much; 0 or less: none."""

    def broken(self, error: Exception) -> None:
        """The worker broke the protocol."""

    def settle(self) -> None:
        """The socket has ended."""


class Wire(asyncio.Protocol):
    """One worker's socket: cuts frames, holds the frame rate, pauses for a slow listener."""

    def __init__(self, listener: Listener) -> None:
        self._listener = listener
        self._reader = FrameReader()
        self._transport: asyncio.Transport | None = None
        self._loop = asyncio.get_running_loop()
        self.paused = self._throttled = False
        self._paid_until = 0.0
        self.closed = False

    def write(self, data: bytes) -> None:
        """Send to the worker, if it is still there."""
        if self._transport is not None:
            self._transport.write(data)

    def read_on(self) -> None:
        """Go on if the listener has caught up and the frame rate allows it."""
        if self.paused and self._transport is not None and not self._throttled and not self._listener.full:
            self.paused = False
            self._transport.resume_reading()

    def drop(self) -> None:
        """Close without reading the rest."""
        if self._transport is not None:
            self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """The socket is ours."""
        self._transport = cast(asyncio.Transport, transport)  # uvloop's only looks like one

    def data_received(self, data: bytes) -> None:
        """Bytes of the worker."""
        try:
            bodies, wanted = self._reader.feed(data), True
            for body in bodies:
                wanted = wanted and self._listener.take(body)
        except (FrameTooLong, ProtocolViolation) as error:
            self._listener.broken(error)
            wanted = False
        if not wanted:
            self.drop()
            return
        now = self._loop.time()
        self._paid_until = max(self._paid_until, now - _BURST) + len(bodies) / FRAME_RATE_MAX
        wait = max(self._paid_until - now, self._listener.hold)
        if wait > 0 and not self._throttled:
            self._throttled = True
            self._loop.call_later(wait, self._unthrottle)
        if self._transport is not None and not self.paused and (self._listener.full or self._throttled):
            self.paused = True
            self._transport.pause_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        """The socket has ended; the process may still be dying."""
        self._transport = None
        self.closed = True
        self._listener.settle()

    def _unthrottle(self) -> None:
        if (wait := self._listener.hold) > 0:
            self._loop.call_later(wait, self._unthrottle)
            return
        self._throttled = False
        self.read_on()
