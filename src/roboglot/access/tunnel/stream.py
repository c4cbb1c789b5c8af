"""One TCP connection at one end of a tunnel: its data goes into the tunnel as far as the other end has room."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import cast

from roboglot.access.tunnel.frames import CREDIT, FrameKind
from roboglot.access.tunnel.link import TunnelLink

WINDOW = 256 * 1024  # bytes of a stream in flight; data for a slow reader waits at the sender
READ_MAX = 512 * 1024  # bytes read from a socket at once, even if the window is almost empty
RECEIVED_MAX = WINDOW + READ_MAX
PIECE = 32 * 1024  # bytes per DATA frame
CREDIT_STEP = WINDOW // 4  # bytes credited at a time


class Stream(asyncio.Protocol):
    """``forget`` is called when the stream is over."""

    def __init__(self, number: int, link: TunnelLink, forget: Callable[[int], None]) -> None:
        self._number, self._link, self._forget = number, link, forget
        self._transport: asyncio.Transport | None = None
        self._credit = WINDOW  # bytes for which the other end has room
        self._held = self._paused = False  # held by a full tunnel; reading paused
        self._clogged = False  # the local client does not read
        self._early = bytearray()  # received before the local connection is open
        self._owed = 0  # bytes taken but not credited yet
        self.undelivered = 0
        """Bytes that the local client has not taken, as far as is known."""
        self._ended_here = self._ended_there = self._over = False

    # -- this end --

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start with the local connection, and deliver earlier data."""
        self._transport = cast(asyncio.Transport, transport)
        if self._over:
            self._transport.abort()
            return
        early, self._early = bytes(self._early), bytearray()
        self.undelivered -= len(early)
        if early:
            self.deliver(early)
        if self._ended_there:
            self._write_end()
        self._throttle()

    def data_received(self, data: bytes) -> None:
        """Send local data into the tunnel."""
        if len(data) <= PIECE:
            self._link.send(FrameKind.DATA, self._number, data)
        else:
            for start in range(0, len(data), PIECE):
                self._link.send(FrameKind.DATA, self._number, data[start : start + PIECE])
        self._credit -= len(data)
        if self._credit <= 0:
            self._throttle()

    def eof_received(self) -> bool:
        """Pass on the end of the local client's data; it may go on reading."""
        self._link.send(FrameKind.EOF, self._number)
        self._ended_here = True
        return not self._ended_there

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's
        """Close the stream with the local connection."""
        if not self._over:
            self._over = True
            self._link.send(FrameKind.CLOSE, self._number)
            self._forget(self._number)

    def pause_writing(self) -> None:
        """Stop crediting: the local client does not read."""
        self._clogged = True

    def resume_writing(self) -> None:
        """Go on delivering: the client reads again."""
        self._clogged = False
        self._owed += self.undelivered
        self.undelivered = 0
        if self._owed >= CREDIT_STEP:
            self._pay()

    # -- the other end --

    def deliver(self, data: bytes) -> None:
        """Deliver data to the local client, or keep it until that is connected."""
        if self._transport is None:
            self.undelivered += len(data)
            self._early += data
            return
        self._transport.write(data)
        self.undelivered += len(data)
        if not self._clogged:
            self._owed += self.undelivered
            self.undelivered = 0
            if self._owed >= CREDIT_STEP:
                self._pay()

    def deliver_end(self) -> None:
        """Pass the end of the far client's data to the local one."""
        self._ended_there = True
        if self._transport is not None:
            self._write_end()

    def give(self, credit: int) -> None:
        """Add credit: bytes for which the other end has room."""
        self._credit = min(WINDOW, self._credit + credit)
        self._throttle()

    def hold(self, held: bool) -> None:
        """Hold or release the stream, as the tunnel is full or no longer."""
        self._held = held
        self._throttle()

    def close(self) -> None:
        """Close the stream after the far connection; earlier data is still delivered."""
        self._over = True
        self._forget(self._number)
        if self._transport is not None:
            self._transport.close()

    def abort(self) -> None:
        """Abort the local connection, as the tunnel is lost."""
        self._over = True
        if self._transport is not None:
            self._transport.abort()

    def _write_end(self) -> None:
        assert self._transport is not None
        if self._ended_here:
            self._transport.close()
        elif self._transport.can_write_eof() and not self._transport.is_closing():
            self._transport.write_eof()

    def _pay(self) -> None:
        """Credit the bytes taken."""
        self._link.send(FrameKind.CREDIT, self._number, CREDIT.pack(self._owed))
        self._owed = 0

    def _throttle(self) -> None:
        """Read from the local client while the other end, and the tunnel, have room."""
        stop = self._held or self._credit <= 0
        if self._transport is None or stop == self._paused or self._transport.is_closing():
            return
        self._paused = stop
        if stop:
            self._transport.pause_reading()
        else:
            self._transport.resume_reading()
