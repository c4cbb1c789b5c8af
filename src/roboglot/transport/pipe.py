"""Two protocols of one process joined as if by TCP, without the kernel: what one writes the other has received.

A tunnel's stream reaches a door by it; a connection over loopback would cost both ends a turn of the loop, and four
system calls a round trip.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextvars import copy_context
from typing import cast

log = logging.getLogger(__name__)

PIECE = 64 * 1024  # bytes received at once
HIGH = 64 * 1024  # bytes queued before the writer must pause, by default

Address = tuple[str, int]


def join(caller: asyncio.Protocol, callee: asyncio.Protocol, called_from: Address, called_at: Address) -> None:
    """Connect both; the callee hears of it first, and what it says at once waits for the caller."""
    near, far = PipeEnd(caller, called_from, called_at), PipeEnd(callee, called_at, called_from)
    near.begin(far)
    far.begin(near)
    far.open()
    near.open()


class PipeEnd(asyncio.Transport):
    """The transport of one of the two protocols. ``get_extra_info("hung_up")``: the other has ended, read or not."""

    def __init__(self, protocol: asyncio.BaseProtocol, own: Address, peer: Address) -> None:
        super().__init__({"sockname": own, "peername": peer})
        self.set_protocol(protocol)
        self._context = copy_context()  # each call gets a copy: no client's name is left for the next
        self._loop = asyncio.get_running_loop()
        self._other: PipeEnd
        self._inbox = bytearray()  # written by the other end and not received here yet
        self._reading = self._taking = False
        self._high, self._low = HIGH, HIGH // 4
        self._crowded = False  # this end was asked to pause
        self._closing = self._lost = self._ended = self._heard_end = False

    def begin(self, other: PipeEnd) -> None:
        """``other`` is the far end."""
        self._other = other

    def open(self) -> None:
        """Have the protocol take over."""
        self._call(self._protocol.connection_made, self)
        if not self._closing:
            self.resume_reading()

    # -- asyncio.WriteTransport ----------------------------------------------------------------------------------------

    def write(self, data: bytes | bytearray | memoryview) -> None:
        """The other end has it at once, unless it rests."""
        if not data or self._closing or self._ended:
            return
        if self._other.lost:
            self.abort()
        else:
            self._other.receive(data)

    def write_eof(self) -> None:
        """End the writing side."""
        if not self._ended:
            self._ended = True
            self._other.receive_end()

    def can_write_eof(self) -> bool:
        """Return True, as TCP does."""
        return True

    def close(self) -> None:
        """End; what was written is still received."""
        if not self._closing:
            self._closing = True
            self.write_eof()
            if not self._other.waiting:
                self._end_soon()

    def abort(self) -> None:
        """End at once, at both ends."""
        self._closing = self._ended = True
        self._end_soon()
        self._other.hang_up()

    def is_closing(self) -> bool:
        """True once either end has hung up."""
        return self._closing

    def get_write_buffer_size(self) -> int:
        """Bytes that the other end has not received."""
        return self._other.waiting

    def get_write_buffer_limits(self) -> tuple[int, int]:
        """Low and high (bytes)."""
        return self._low, self._high

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        """Set when the writer is asked to pause, and when to go on, in bytes."""
        self._high = high if high is not None else (4 * low if low is not None else HIGH)
        self._low = low if low is not None else self._high // 4

    # -- asyncio.ReadTransport -----------------------------------------------------------------------------------------

    def is_reading(self) -> bool:
        """True unless it rests."""
        return self._reading

    def pause_reading(self) -> None:
        """Keep incoming bytes here."""
        self._reading = False

    def resume_reading(self) -> None:
        """Receive what waits, and go on."""
        if not self._reading and not self._lost:
            self._reading = True
            if self._inbox or self._other.ended:
                self._loop.call_soon(self._drain)

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        """Have another one."""
        self._protocol = cast(asyncio.Protocol, protocol)  # that of a stream

    def get_protocol(self) -> asyncio.BaseProtocol:
        """Return whose end this is."""
        return self._protocol

    def get_extra_info(self, name: str, default: object = None) -> object:
        """Return the default: there is no socket."""
        return self._other.ended if name == "hung_up" else super().get_extra_info(name, default)

    # -- called by the other end ---------------------------------------------------------------------------------------

    @property
    def waiting(self) -> int:
        """Bytes that wait to be received here."""
        return len(self._inbox)

    @property
    def ended(self) -> bool:
        """True when nothing more comes from here."""
        return self._ended

    @property
    def lost(self) -> bool:
        """True when nothing is received here any more."""
        return self._lost

    def receive(self, data: bytes | bytearray | memoryview) -> None:
        """Take what the other end wrote."""
        free = self._reading and not self._taking
        if free and not self._inbox and len(data) <= PIECE:
            self._taking = True  # answers may make the other end write; those bytes wait
            self._call(self._protocol.data_received, bytes(data))
            self._taking = False
            if self._inbox and self._reading:
                self._loop.call_soon(self._drain)
            return
        self._inbox += data
        self._other.make_room(len(self._inbox))
        if free:
            self._drain()

    def receive_end(self) -> None:
        """The other end writes no more."""
        if self._reading and not self._lost:
            self._loop.call_soon(self._drain)

    def hang_up(self) -> None:
        """The other end was aborted."""
        self._closing = self._ended = True
        self._end_soon()

    def make_room(self, waiting: int) -> None:
        """Ask the protocol to pause, or to go on, by what waits at the other end."""
        if not self._crowded and waiting > self._high:
            self._crowded = True
            self._call(self._protocol.pause_writing)
        elif self._crowded and waiting <= self._low:
            self._crowded = False
            self._call(self._protocol.resume_writing)

    def drained(self) -> None:
        """The other end has received everything."""
        if self._closing:
            self._end_soon()

    # -- this end ------------------------------------------------------------------------------------------------------

    def _drain(self) -> None:
        while self._inbox and self._reading and not self._lost:
            data = bytes(self._inbox[:PIECE])
            del self._inbox[:PIECE]
            self._taking = True
            self._call(self._protocol.data_received, data)
            self._taking = False
        if self._lost:
            return
        self._other.make_room(len(self._inbox))
        if self._inbox or not self._reading:
            return
        self._other.drained()
        if self._other.ended and not self._heard_end:
            self._heard_end = True
            if not self._call(self._protocol.eof_received):
                self.close()

    def _call(self, method: Callable[..., object], *values: object) -> object:
        """Call the protocol; its errors end the connection, as everywhere in asyncio, and no one else's work."""
        try:
            return self._context.copy().run(method, *values)
        except Exception:
            log.exception("a connection within the process broke")
            self.abort()
            return None

    def _end_soon(self) -> None:
        if not self._lost:
            self._lost = True
            self._inbox.clear()
            self._reading = False
            self._other.drained()
            self._loop.call_soon(self._call, self._protocol.connection_lost, None)
