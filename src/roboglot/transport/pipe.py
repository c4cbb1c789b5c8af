"""Connects two protocols of one process as if by TCP, without the kernel: written bytes are received at once.

A tunnel's stream reaches a door this way; a connection over loopback would cost each end a turn of the loop, and four
system calls per round trip.
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
    """Connect both protocols, the callee first; bytes that it writes at once wait for the caller."""
    near, far = PipeEnd(caller, called_from, called_at), PipeEnd(callee, called_at, called_from)
    near.begin(far)
    far.begin(near)
    far.open()
    near.open()


class PipeEnd(asyncio.Transport):
    """Transport of one of the two protocols. ``get_extra_info("hung_up")``: True once the other end has ended."""

    def __init__(self, protocol: asyncio.BaseProtocol, own: Address, peer: Address) -> None:
        super().__init__({"sockname": own, "peername": peer})
        self.set_protocol(protocol)
        self._context = copy_context()  # each call gets a copy, so that no client's name stays for the next
        self._loop = asyncio.get_running_loop()
        self._other: PipeEnd
        self._inbox = bytearray()  # written by the other end, not yet received here
        self._reading = self._taking = False
        self._high, self._low = HIGH, HIGH // 4
        self._crowded = False  # this end's protocol was asked to pause
        self._closing = self._lost = self._ended = self._heard_end = False

    def begin(self, other: PipeEnd) -> None:
        """Set the far end."""
        self._other = other

    def open(self) -> None:
        """Connect the protocol and start reading."""
        self._call(self._protocol.connection_made, self)
        if not self._closing:
            self.resume_reading()

    # -- asyncio.WriteTransport --

    def write(self, data: bytes | bytearray | memoryview) -> None:
        """Pass bytes to the other end, at once unless it has paused reading."""
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
        """Return True, as for TCP."""
        return True

    def close(self) -> None:
        """Close this end; bytes already written are still received."""
        if not self._closing:
            self._closing = True
            self.write_eof()
            if not self._other.waiting:
                self._end_soon()

    def abort(self) -> None:
        """Close both ends at once."""
        self._closing = self._ended = True
        self._end_soon()
        self._other.hang_up()

    def is_closing(self) -> bool:
        """Return True once either end has hung up."""
        return self._closing

    def get_write_buffer_size(self) -> int:
        """Return the number of bytes that the other end has not received."""
        return self._other.waiting

    def get_write_buffer_limits(self) -> tuple[int, int]:
        """Return the low and the high limit, bytes."""
        return self._low, self._high

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        """Set the limits above which the writer pauses and below which it resumes, bytes."""
        self._high = high if high is not None else (4 * low if low is not None else HIGH)
        self._low = low if low is not None else self._high // 4

    # -- asyncio.ReadTransport --

    def is_reading(self) -> bool:
        """Return True unless reading is paused."""
        return self._reading

    def pause_reading(self) -> None:
        """Pause reading; incoming bytes wait here."""
        self._reading = False

    def resume_reading(self) -> None:
        """Receive the waiting bytes and resume reading."""
        if not self._reading and not self._lost:
            self._reading = True
            if self._inbox or self._other.ended:
                self._loop.call_soon(self._drain)

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        """Replace the protocol."""
        self._protocol = cast(asyncio.Protocol, protocol)  # a stream's protocol

    def get_protocol(self) -> asyncio.BaseProtocol:
        """Return the protocol."""
        return self._protocol

    def get_extra_info(self, name: str, default: object = None) -> object:
        """Return ``hung_up``, the addresses, or the default, as there is no socket."""
        return self._other.ended if name == "hung_up" else super().get_extra_info(name, default)

    # -- called by the other end --

    @property
    def waiting(self) -> int:
        """Number of bytes that wait to be received here."""
        return len(self._inbox)

    @property
    def ended(self) -> bool:
        """True when this end writes no more."""
        return self._ended

    @property
    def lost(self) -> bool:
        """True when this end receives no more."""
        return self._lost

    def receive(self, data: bytes | bytearray | memoryview) -> None:
        """Take bytes that the other end wrote."""
        free = self._reading and not self._taking
        if free and not self._inbox and len(data) <= PIECE:
            self._taking = True  # bytes that the other end writes meanwhile wait
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
        """Note that the other end writes no more."""
        if self._reading and not self._lost:
            self._loop.call_soon(self._drain)

    def hang_up(self) -> None:
        """End this end, as the other one was aborted."""
        self._closing = self._ended = True
        self._end_soon()

    def make_room(self, waiting: int) -> None:
        """Ask the protocol to pause or resume writing, depending on the bytes that wait at the other end."""
        if not self._crowded and waiting > self._high:
            self._crowded = True
            self._call(self._protocol.pause_writing)
        elif self._crowded and waiting <= self._low:
            self._crowded = False
            self._call(self._protocol.resume_writing)

    def drained(self) -> None:
        """Note that the other end has received everything."""
        if self._closing:
            self._end_soon()

    # -- this end --

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
        """Call the protocol; its errors end only this connection, as everywhere in asyncio."""
        try:
            return self._context.copy().run(method, *values)
        except Exception:
            log.exception("a connection within the process crashed")
            self.abort()
            return None

    def _end_soon(self) -> None:
        if not self._lost:
            self._lost = True
            self._inbox.clear()
            self._reading = False
            self._other.drained()
            self._loop.call_soon(self._call, self._protocol.connection_lost, None)
