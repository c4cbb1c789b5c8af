"""Connections through a proxy: each incoming one is joined with a new outgoing one, and bytes pass at once."""

from __future__ import annotations

import asyncio
import logging
import ssl
import time
from collections import deque
from collections.abc import Awaitable, Callable
from typing import cast

from roboglot.model.clock import Clock
from roboglot.transport.listening import listen
from roboglot.transport.log_limiter import LogLimiter
from roboglot.transport.tls import Tls, TlsCall, TlsPort
from roboglot.values import dataclass

log = logging.getLogger(__name__)
limited_log = LogLimiter(log)
CONNECT_SECONDS = 10.0
CONNECTIONS_MAX = 256
DELAYS_MAX = 100_000
BUFFER_MAX = 1 << 20  # bytes kept until the other end is connected
Joining = Callable[["End", "End"], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class Place:
    """Address to dial. ``context``: of TLS; the other end must prove to be ``name``. ``own``: local address."""

    host: str
    port: int
    context: ssl.SSLContext | None = None
    name: str = ""
    own: str = ""

    async def dial(self, end: End) -> None:
        """Connect ``end``. Raises OSError."""
        loop, context = asyncio.get_running_loop(), self.context
        end.is_encrypted = context is not None
        if context is None:
            own = (self.own, 0) if self.own else None
            await loop.create_connection(lambda: end, self.host, self.port, local_addr=own)
            return
        transport, call = await loop.create_connection(
            lambda: _TimedCall(end, context, self.name), self.host, self.port
        )
        try:
            await call.over
        except BaseException:
            transport.abort()
            raise


class Stopwatch:
    """Delays from bytes received to bytes passed on, the last ``DELAYS_MAX``, decryption and encryption included.

    ``delays``: ns by the clock; ``computed``: ns that this thread had a processor in them. The difference is others'.
    Waiting in the system before this process ran is in neither.
    """

    def __init__(self) -> None:
        self.delays: deque[int] = deque(maxlen=DELAYS_MAX)
        self.computed: deque[int] = deque(maxlen=DELAYS_MAX)
        self._began = self._used = 0

    def begin(self) -> None:
        """Note that bytes were received."""
        self._began, self._used = time.perf_counter_ns(), time.thread_time_ns()

    def end(self) -> None:
        """Note that the bytes were passed on."""
        self.delays.append(time.perf_counter_ns() - self._began)
        self.computed.append(time.thread_time_ns() - self._used)

    def summary(self) -> str:
        """Return median and 99th percentile of both (ms) in a line; empty if nothing has passed."""
        if not self.delays:
            return ""
        half, most, own_half, own_most = (
            sorted(times)[int(part * len(times))] / 1e6
            for times in (self.delays, self.computed)
            for part in (0.5, 0.99)
        )
        return (
            f"passing bytes on took {half:.3f} ms (median) and {most:.3f} ms (99 %), "
            f"{own_half:.3f} and {own_most:.3f} ms of it on the processor"
        )


class _TimedCall(TlsCall):
    """An outgoing connection whose stopwatch begins with encrypted bytes."""

    def __init__(self, end: End, context: ssl.SSLContext, name: str) -> None:
        super().__init__(lambda: end, context, name)
        self._begin = end.watch.begin

    def data_received(self, data: bytes) -> None:
        self._begin()
        super().data_received(data)


class _TimedPort(TlsPort):
    """The same for an incoming connection."""

    def __init__(self, came: Callable[[End], None], context: ssl.SSLContext, watch: Stopwatch) -> None:
        super().__init__(lambda: End(watch, came, is_encrypted=True), Tls(context, plain=False))
        self._begun = watch.begin

    def data_received(self, data: bytes) -> None:
        self._begun()
        super().data_received(data)


class End(asyncio.Protocol):
    """One end of a connection; ``other`` gets its bytes first, then the sniffer a copy; empty bytes mean the end."""

    transport: asyncio.Transport

    def __init__(
        self, watch: Stopwatch, came: Callable[[End], None] = lambda _: None, *, is_encrypted: bool = False
    ) -> None:
        """``came`` is called when the end is connected. Of an encrypted end, the connection begins the watch."""
        self._came, self.watch, self.is_encrypted = came, watch, is_encrypted
        self.other: End | None = None
        self.look: Callable[[bytes], None] | None = None
        self.waiting = bytearray()
        self._ended = False  # its peer sends no more
        self.gone: Callable[[End], None] = lambda _: None
        self.lost: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    @property
    def peer(self) -> tuple[str, int]:
        """Host and port at the other end of the wire; "" and 0 if that is gone already."""
        host, port = (self.transport.get_extra_info("peername") or ("", 0))[:2]
        return str(host), int(port)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)
        # No write buffer, so that data go to the system at once; uvloop would otherwise collect writes until all
        # received data are handled.
        self.transport.set_write_buffer_limits(high=0)
        self._came(self)

    def data_received(self, data: bytes) -> None:
        if not self.is_encrypted:
            self.watch.begin()
        if self.other is None:
            self.waiting += data
            if len(self.waiting) > BUFFER_MAX:
                self.transport.pause_reading()
        else:
            self.other.transport.write(data)
            self.watch.end()
        self._look(data)

    def _look(self, data: bytes) -> None:
        if self.look is not None:
            try:
                self.look(data)
            except Exception as error:  # noqa: BLE001 - bytes that cannot be parsed still pass
                log.warning("cannot parse the rest of a connection, its bytes still pass: %s", error)
                self.look = None

    def join(self, other: End) -> None:
        """Pass everything to ``other`` from now on, received data first."""
        self.other = other
        if other.lost.done():
            self.transport.close()
            return
        if self.waiting:
            other.transport.write(bytes(self.waiting))
            self.waiting.clear()
            if not self.lost.done():
                self.transport.resume_reading()
        if self._ended and not self.eof_received():
            self.transport.close()

    def pause_writing(self) -> None:
        if self.other is not None and not self.other.transport.is_closing():
            self.other.transport.pause_reading()

    def resume_writing(self) -> None:
        if self.other is not None and not self.other.transport.is_closing():
            self.other.transport.resume_reading()

    def eof_received(self) -> bool:
        """Pass on the end of the peer's data; close both ends where a half-close is impossible, as under TLS."""
        self._ended = True
        self._look(b"")
        if self.other is None:
            return True  # until it is joined
        if can_say := self.other.transport.can_write_eof():
            self.other.transport.write_eof()
        return can_say

    def connection_lost(self, _exc: Exception | None) -> None:
        self.gone(self)
        if not self.lost.done():
            self.lost.set_result(None)
        if self.other is not None:
            self.other.transport.close()


class TcpProxy:
    """Listens, and joins incoming connections with outgoing ones."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._servers: list[asyncio.Server] = []
        self._ends: set[End] = set()
        self._dialling: set[asyncio.Task[None]] = set()
        self.watch = Stopwatch()

    async def listen(self, host: str, port: int, came: Callable[[End], None], context: ssl.SSLContext | None) -> None:
        """Listen; ``came`` is called for each connection, with TLS after the handshake. Raises OSError."""

        def end() -> asyncio.Protocol:
            return End(self.watch, came) if context is None else _TimedPort(came, context, self.watch)

        self._servers.append(await listen(end, host, port))

    def cross(self, came: End, to: Place, robot: End, joining: Joining | None = None) -> None:
        """Dial ``to`` as ``robot`` for the incoming end; ``joining`` is awaited before any byte passes."""
        crossing = self._cross(came, to, robot, joining)
        task = asyncio.get_running_loop().create_task(crossing, name=f"crossing to {to.port}")
        self._dialling.add(task)
        task.add_done_callback(self._dialling.discard)

    async def _cross(self, came: End, to: Place, made: End, joining: Joining | None) -> None:
        if len(self._ends) + 2 * len(self._dialling) > 2 * CONNECTIONS_MAX:
            came.transport.abort()
            return
        try:
            await self._clock.wait_for(to.dial(made), CONNECT_SECONDS)
        except (OSError, TimeoutError) as error:
            why = (error.strerror or str(error) or "it takes too long").lower()
            limited_log.warning(to.host, "%s:%d cannot be reached for %s:%d: %s", to.host, to.port, *came.peer, why)
            came.transport.abort()
            return
        if came.transport.is_closing():
            made.transport.abort()
            return
        for end in (came, made):
            self._ends.add(end)
            end.gone = self._ends.discard
        if joining is not None:
            await joining(came, made)
        came.join(made)
        made.join(came)

    async def close(self) -> None:
        """Stop listening and hang up; returns when every connection is gone."""
        for server in self._servers:
            server.close()
        dialling = tuple(self._dialling)
        for task in dialling:
            task.cancel()
        await asyncio.gather(*dialling, return_exceptions=True)
        ends = tuple(self._ends)
        for end in ends:
            end.transport.abort()
        await asyncio.gather(*(end.lost for end in ends))
