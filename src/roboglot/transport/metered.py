"""Limits the bytes a second to and from a client: beyond the limit, reading from the client pauses."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import cast

Spend = Callable[[int], float]
PAUSE_MIN = 0.01  # s: shorter debts are carried over
STEP = 4096  # bytes counted together: most messages are short


class Metered(asyncio.Protocol):
    """Metered transport in front of ``inner``.

    ``spend`` takes a number of bytes and returns the seconds to wait before the next.
    """

    def __init__(self, inner: asyncio.Protocol, spend: Spend, ended: Callable[[], None]) -> None:
        """Meter ``inner``; ``ended`` is called when the connection is lost."""
        self.inner = inner
        self._spend, self._ended = spend, ended
        self._valve: Valve | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Give the inner protocol a counting transport."""
        self._valve = Valve(cast(asyncio.Transport, transport), self, self._spend)
        self.inner.connection_made(cast(asyncio.BaseTransport, self._valve))

    def data_received(self, data: bytes) -> None:
        """Count the bytes and pass them on."""
        assert self._valve is not None
        self._valve.uncounted += len(data)
        if self._valve.uncounted >= STEP:
            self._valve.count()
        self.inner.data_received(data)

    def eof_received(self) -> bool | None:
        """Pass on."""
        return self.inner.eof_received()

    def connection_lost(self, exc: Exception | None) -> None:
        """Pass on."""
        if self._valve is not None:
            self._valve.end()
        self._ended()
        self.inner.connection_lost(exc)

    def pause_writing(self) -> None:
        """Pass on."""
        self.inner.pause_writing()

    def resume_writing(self) -> None:
        """Pass on."""
        self.inner.resume_writing()


class Valve:
    """Transport of the inner protocol; reading continues only if neither the protocol nor the meter pauses it."""

    def __init__(self, transport: asyncio.Transport, meter: Metered, spend: Spend) -> None:
        self._transport, self._meter, self._spend = transport, meter, spend
        self.is_closing = transport.is_closing  # bound once: called for every message
        self._paused = False  # by the inner protocol
        self.uncounted = 0
        """Bytes since the last ``count``, which the callers make from STEP bytes on."""
        self._waiting: asyncio.TimerHandle | None = None

    def count(self) -> None:
        """Count the bytes; pause reading if they exceed the limit."""
        size, self.uncounted = self.uncounted, 0
        wait = self._spend(size)
        if wait > PAUSE_MIN and self._waiting is None and not self._transport.is_closing():
            self._transport.pause_reading()
            self._waiting = asyncio.get_running_loop().call_later(wait, self._open)

    def end(self) -> None:
        """Cancel the pause of a lost connection."""
        if self._waiting is not None:
            self._waiting.cancel()
            self._waiting = None

    def write(self, data: bytes | bytearray | memoryview) -> None:
        """Count and send."""
        self.uncounted += len(data)
        if self.uncounted >= STEP:
            self.count()
        self._transport.write(data)

    def writelines(self, pieces: list[bytes]) -> None:
        """Count and send."""
        self.write(b"".join(pieces))

    def pause_reading(self) -> None:
        """Pause reading for the inner protocol."""
        if not self._paused:
            self._paused = True
            self._transport.pause_reading()

    def resume_reading(self) -> None:
        """Resume reading unless the meter pauses it."""
        if self._paused:
            self._paused = False
            if self._waiting is None:
                self._transport.resume_reading()

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        """Replace the inner protocol."""
        self._meter.inner = cast(asyncio.Protocol, protocol)

    def get_protocol(self) -> asyncio.BaseProtocol:
        """Return the inner protocol."""
        return self._meter.inner

    def __getattr__(self, name: str) -> object:
        return getattr(self._transport, name)

    def _open(self) -> None:
        self._waiting = None
        if not self._paused and not self._transport.is_closing():
            self._transport.resume_reading()
