"""The server's end of a worker's socket. Knows frames and their rate, not their contents. Times are in machine time."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import Protocol, cast

from roboglot.programs.engine.messages import ProtocolViolation
from roboglot.programs.engine.share import Account, ThreadShare
from roboglot.programs.worker.frames import FrameReader, FrameTooLong

FRAME_RATE_MAX = 10_000
"""Most frames a second, printing included, read from a worker; a faster worker has to wait."""
_BURST = 0.1
"""Burst that the frame rate allows, in seconds of frames."""


class Listener(Protocol):
    """Receiver of a wire's frames."""

    def take(self, body: bytes) -> bool:
        """Take one frame; return False when no more frames matter. Raises ProtocolViolation."""

    @property
    def full(self) -> bool:
        """True while reading should pause until ``read_on``."""

    def broken(self, error: Exception) -> None:
        """Handle a breach of the protocol by the worker."""

    def settle(self) -> None:
        """Note that the socket has ended."""


class Wire(asyncio.Protocol):
    """One worker's socket: cuts frames, limits their rate, pauses for a slow listener.

    Frames wait for their turn while the worker's ``account`` is overdrawn.
    """

    def __init__(self, listener: Listener, account: Account | None = None) -> None:
        self._listener = listener
        self._account = account or ThreadShare().account()
        self._reader = FrameReader()
        self.frames: deque[bytes] = deque()
        """Bodies that have come and wait for their turn."""
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
        """Continue reading if the listener has caught up and the frame rate allows it."""
        if self.paused and self._transport is not None and not self._throttled and not self._listener.full:
            self.paused = False
            self._transport.resume_reading()

    def drop(self) -> None:
        """Close without reading the rest."""
        self.frames.clear()
        if self._transport is not None:
            self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the transport."""
        self._transport = cast(asyncio.Transport, transport)  # uvloop's transport does not inherit from it

    def data_received(self, data: bytes) -> None:
        """Take bytes of the worker."""
        if not self.frames and (body := self._reader.whole(data)) is not None:
            self._pass_on(body)
            self._pace(1)
            return
        try:
            self.frames += self._reader.feed(data)
        except FrameTooLong as error:
            self._take_all()
            self._break(error)
            return
        self._take()

    def _take(self) -> None:
        """Pass on as many frames as allowed, then decide whether to read on."""
        self._pace(self._take_some())

    def _pace(self, taken: int) -> None:
        """Count so many frames; pause reading if it has to wait."""
        if self.closed or self._transport is None:
            return
        now = self._loop.time()
        paid, least = self._paid_until, now - _BURST
        self._paid_until = paid = (paid if paid > least else least) + taken / FRAME_RATE_MAX
        if not self._throttled and (paid > now or self.frames or self._account.paid_until > now):
            self._throttled = True
            self._loop.call_later(max(0.0, self._paid_until - now), self._account.go_on, self._unthrottle)
        if not self.paused and (self._listener.full or self._throttled):
            self.paused = True
            self._transport.pause_reading()

    def _take_some(self) -> int:
        taken = 0
        while self.frames and not (taken and self._account.spent):
            taken += 1
            self._pass_on(self.frames.popleft())
        return taken

    def _pass_on(self, body: bytes) -> None:
        try:
            if not self._listener.take(body):
                self.drop()
        except ProtocolViolation as error:
            self._break(error)

    def _take_all(self) -> None:
        """Take the frames that came before the end."""
        while self.frames:
            self._take_some()

    def _break(self, error: Exception) -> None:
        self._listener.broken(error)
        self.drop()

    def connection_lost(self, _exc: Exception | None) -> None:
        """Pass on the remaining frames and settle; the process may still be dying."""
        self._take_all()
        self._transport = None
        self.closed = True
        self._listener.settle()

    def _unthrottle(self) -> None:
        self._throttled = False
        if self.frames:
            self._take()
        self.read_on()
