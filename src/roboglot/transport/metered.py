"""Limits the bytes a second to and from a client: beyond the limit, reading from the client pauses.

Clients also take turns: one that sends millions of tiny messages is read on when others have been served.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextvars import copy_context
from time import perf_counter
from typing import cast

Spend = Callable[[int], float]
PAUSE_MIN = 0.01  # s: shorter debts are carried over
STEP = 4096  # bytes counted together: most messages are short
SLICE = 4096  # bytes passed on at once, of the up to 8 MB that a loop reads from a socket in one go
TURN = 0.002  # s for which a connection may go on with such slices


class Metered(asyncio.Protocol):
    """Metered transport in front of ``inner``.

    ``spend`` takes a number of bytes and returns the seconds to wait before the next.
    """

    def __init__(self, inner: asyncio.Protocol, spend: Spend, ended: Callable[[], None]) -> None:
        """Meter ``inner``; ``ended`` is called when the connection is lost."""
        self.inner = inner
        self._spend, self._ended = spend, ended
        self._valve: Valve | None = None
        self._rest = b""  # received, to be passed on in later turns
        self._ends = self._due = False  # the client has sent all; the next turn is scheduled

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Give the inner protocol a counting transport."""
        self._context = copy_context()  # the loop's own, which knows no client
        self._valve = Valve(cast(asyncio.Transport, transport), self, self._spend)
        self.inner.connection_made(cast(asyncio.BaseTransport, self._valve))

    def data_received(self, data: bytes) -> None:
        """Count the bytes and pass them on."""
        assert self._valve is not None
        self._valve.uncounted += len(data)
        if self._valve.uncounted >= STEP:
            self._valve.count()
        if self._rest:
            self._rest += data
        elif len(data) <= SLICE:
            self.inner.data_received(data)
        else:
            self._rest = data
            self._pass_on()

    def _pass_on(self) -> None:
        """Pass waiting bytes on for one turn; the rest follows once others have been served."""
        valve, end = self._valve, perf_counter() + TURN
        assert valve is not None
        self._due, at, data = False, 0, self._rest
        while at < len(data) and not valve.paused and not valve.is_closing():
            self.inner.data_received(data[at : at + SLICE])
            at += SLICE
            if perf_counter() >= end:
                break
        self._rest = b"" if valve.is_closing() else data[at:]
        valve.hold(behind=bool(self._rest))
        if self._rest:
            self.go_on()
        elif self._ends:
            self._ends = False
            if not self.inner.eof_received():
                valve.close()

    def go_on(self) -> None:
        """Schedule a turn if bytes are waiting and the inner protocol takes them."""
        if self._rest and not self._due and self._valve is not None and not self._valve.paused:
            self._due = True
            asyncio.get_running_loop().call_soon(self._pass_on, context=self._context)

    def eof_received(self) -> bool | None:
        """Pass on, after the waiting bytes."""
        if self._rest:
            self._ends = True
            return True
        return self.inner.eof_received()

    def connection_lost(self, exc: Exception | None) -> None:
        """Pass on."""
        self._rest, self._ends = b"", False
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
    """Transport of the inner protocol; reading continues only if neither that nor the meter pauses it.

    ``paused``: by the inner protocol.
    """

    def __init__(self, transport: asyncio.Transport, meter: Metered, spend: Spend) -> None:
        self._transport, self._meter, self._spend = transport, meter, spend
        self.is_closing = transport.is_closing  # bound once: called for every message
        self.close = transport.close
        self.paused = self._behind = False
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
        if not self.paused:
            self.paused = True
            self._transport.pause_reading()

    def resume_reading(self) -> None:
        """Resume reading unless the meter pauses it."""
        if self.paused:
            self.paused = False
            self._meter.go_on()
            self._read_on()

    def hold(self, *, behind: bool) -> None:
        """Pause reading while the inner protocol is ``behind``."""
        if behind != self._behind:
            self._behind = behind
            if behind:
                self._transport.pause_reading()
            else:
                self._read_on()

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
        self._read_on()

    def _read_on(self) -> None:
        if not (self.paused or self._behind or self._waiting or self._transport.is_closing()):
            self._transport.resume_reading()
