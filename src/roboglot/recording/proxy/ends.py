"""Connections through a proxy: each incoming one is joined with a new outgoing one, and bytes pass at once."""

from __future__ import annotations

import asyncio
import logging
import ssl
from collections.abc import Awaitable, Callable
from typing import cast

from roboglot.model.clock import Clock
from roboglot.transport.seldom import Seldom
from roboglot.transport.tls import Tls, TlsCall, TlsPort
from roboglot.values import dataclass

log = logging.getLogger(__name__)
seldom = Seldom(log)
CONNECT_SECONDS = 10.0
CONNECTIONS_MAX = 256
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
        if context is None:
            own = (self.own, 0) if self.own else None
            await loop.create_connection(lambda: end, self.host, self.port, local_addr=own)
            return
        transport, call = await loop.create_connection(
            lambda: TlsCall(lambda: end, context, self.name), self.host, self.port
        )
        try:
            await call.over
        except BaseException:
            transport.abort()
            raise


class End(asyncio.Protocol):
    """One end of a connection; ``other`` gets its bytes first, then the sniffer a copy."""

    transport: asyncio.Transport

    def __init__(self, came: Callable[[End], None] = lambda _: None) -> None:
        """``came`` is called when the end is connected."""
        self._came = came
        self.other: End | None = None
        self.look: Callable[[bytes], None] | None = None
        self.waiting = bytearray()
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
        if self.other is None:
            self.waiting += data
            if len(self.waiting) > BUFFER_MAX:
                self.transport.pause_reading()
        else:
            self.other.transport.write(data)
        if self.look is not None:
            try:
                self.look(data)
            except Exception as error:  # noqa: BLE001 - bytes that cannot be parsed still pass
                log.warning("cannot parse a connection any more, its bytes still pass: %s", error)
                self.look = None

    def join(self, other: End) -> None:
        """Pass everything to ``other`` from now on, received data first."""
        self.other = other
        if self.waiting:
            other.transport.write(bytes(self.waiting))
            self.waiting.clear()
            self.transport.resume_reading()

    def pause_writing(self) -> None:
        if self.other is not None and not self.other.transport.is_closing():
            self.other.transport.pause_reading()

    def resume_writing(self) -> None:
        if self.other is not None and not self.other.transport.is_closing():
            self.other.transport.resume_reading()

    def eof_received(self) -> bool:
        if self.other is not None and self.other.transport.can_write_eof():
            self.other.transport.write_eof()
        return True

    def connection_lost(self, _exc: Exception | None) -> None:
        self.gone(self)
        if not self.lost.done():
            self.lost.set_result(None)
        if self.other is not None:
            self.other.transport.close()


class Crossing:
    """Listens, and joins incoming connections with outgoing ones."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._servers: list[asyncio.Server] = []
        self._ends: set[End] = set()
        self._dialling: set[asyncio.Task[None]] = set()

    async def listen(self, host: str, port: int, came: Callable[[End], None], context: ssl.SSLContext | None) -> None:
        """Listen; ``came`` is called for each connection, with TLS after the handshake. Raises OSError."""

        def end() -> asyncio.Protocol:
            return End(came) if context is None else TlsPort(lambda: End(came), Tls(context, plain=False))

        self._servers.append(await asyncio.get_running_loop().create_server(end, host, port))

    def cross(self, came: End, to: Place, robot: End, joining: Joining | None = None) -> None:
        """Dial ``to`` as ``robot`` for the incoming end; ``joining`` is awaited before any byte passes."""
        crossing = self._cross(came, to, robot, joining)
        task = asyncio.get_running_loop().create_task(crossing, name=f"crossing to {to.port}")
        self._dialling.add(task)
        task.add_done_callback(self._dialling.discard)

    async def _cross(self, came: End, to: Place, made: End, joining: Joining | None) -> None:
        if len(self._ends) >= 2 * CONNECTIONS_MAX:
            came.transport.abort()
            return
        try:
            await self._clock.wait_for(to.dial(made), CONNECT_SECONDS)
        except (OSError, TimeoutError) as error:
            why = (error.strerror or str(error) or "it takes too long").lower()
            seldom.warning(to.host, "%s:%d cannot be reached for %s:%d: %s", to.host, to.port, *came.peer, why)
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
