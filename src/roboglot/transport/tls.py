"""TLS in front of any protocol, for clients and servers; a port may also take plain connections, by the first byte.

A server can refuse a handshake before it costs anything; it ends within HANDSHAKE_SECONDS_MAX. Works over the
transports of all loops, without the loops' own TLS, whose handshake cannot be refused, and which takes twice as long
for a short message.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import ssl
from collections.abc import Callable
from pathlib import Path
from typing import cast

from roboglot.text_files import open_bytes
from roboglot.transport.log_limiter import LogLimiter
from roboglot.values import dataclass

log = logging.getLogger(__name__)
seldom = LogLimiter(log)

HANDSHAKE_SECONDS_MAX = 5.0
HANDSHAKE_BYTES_MAX = 64 * 1024  # from the client before the handshake is complete
RECORD_MAX = 16 * 1024  # bytes per record
REPLIES_MAX = 16 * 1024  # bytes of TLS messages in reply to the peer, per connection: refused handshakes, new keys
HELLO = 0x16  # the first byte of a TLS connection: a handshake record

Factory = Callable[[], asyncio.Protocol]


@dataclass(frozen=True, slots=True)
class Tls:
    """Encryption of a port. ``plain``: also accept connections without encryption."""

    context: ssl.SSLContext
    plain: bool = True


def server_context(certificate: Path, key: Path, oldest: ssl.TLSVersion = ssl.TLSVersion.TLSv1_2) -> ssl.SSLContext:
    """Return a server's context without renegotiation, compression and resumption. Raises OSError, ssl.SSLError."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = oldest
    context.options |= ssl.OP_NO_RENEGOTIATION | ssl.OP_NO_COMPRESSION | ssl.OP_NO_TICKET
    context.num_tickets = 0
    for file in (certificate, key):
        open_bytes(file).close()  # OpenSSL would wait for the writer of a named pipe
    context.load_cert_chain(certificate, key)
    return context


class TlsEnd(asyncio.Protocol):
    """One end of a connection: common part of both ends, from the handshake on."""

    def __init__(self, factory: Factory) -> None:
        self._factory = factory
        self.inner: asyncio.Protocol | None = None
        self._transport: asyncio.Transport
        self._incoming: ssl.MemoryBIO
        self._outgoing: ssl.MemoryBIO
        self._tunnel: ssl.SSLObject | None = None
        self._gone: Callable[[], bool]
        self._encrypted: Callable[[bytes | bytearray | memoryview], int]
        self._received = 0
        self._replied = 0
        self._stays: bool | None = None  # since the end of the other side's data: the inner protocol has answers
        self._host = ""
        self._timeout: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Limit the time for the handshake."""
        self._transport = cast(asyncio.Transport, transport)
        self._gone = self._transport.is_closing  # bound once: called for every message
        self._host = (transport.get_extra_info("peername") or ("",))[0]
        self._timeout = asyncio.get_running_loop().call_later(HANDSHAKE_SECONDS_MAX, self._transport.abort)

    def data_received(self, data: bytes) -> None:
        """Continue the handshake, or decrypt after it."""
        if self._stays is not None:
            return  # behind the end
        self._incoming.write(data)
        if self.inner is None and not self._shake_hands(len(data)):
            return
        self._read()

    def eof_received(self) -> bool:
        """Pass on the end of the other side's data; stay open for answers under way."""
        if self._stays is None:
            self._stays = self.inner is not None and bool(self.inner.eof_received())
        return self._stays and not self._gone()

    def connection_lost(self, exc: Exception | None) -> None:
        """Notify the inner protocol."""
        self._calm_down()
        if self.inner is not None:
            self.inner.connection_lost(exc)

    def pause_writing(self) -> None:
        """Pass on."""
        if self.inner is not None:
            self.inner.pause_writing()

    def resume_writing(self) -> None:
        """Pass on."""
        if self.inner is not None:
            self.inner.resume_writing()

    def send(self, data: bytes | bytearray | memoryview) -> None:
        """Encrypt and send."""
        if data and not self._gone():
            self._encrypted(data)
            self._transport.write(self._outgoing.read())

    def say_goodbye(self) -> None:
        """Send TLS's notice of the end."""
        if self._tunnel is not None and not self._transport.is_closing():
            with contextlib.suppress(ssl.SSLError):
                self._tunnel.unwrap()
            self._flush()

    @property
    def tunnel(self) -> ssl.SSLObject | None:
        """Encryption of the connection; None before the handshake."""
        return self._tunnel

    def _encrypt(self, context: ssl.SSLContext, *, server_side: bool, name: str | None = None) -> None:
        self._incoming, self._outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        self._tunnel = context.wrap_bio(self._incoming, self._outgoing, server_side=server_side, server_hostname=name)
        self._encrypted = self._tunnel.write

    def _shake_hands(self, size: int) -> bool:
        assert self._tunnel is not None
        self._received += size
        try:
            self._tunnel.do_handshake()
        except ssl.SSLWantReadError:
            self._flush()
            if self._received > HANDSHAKE_BYTES_MAX:
                self._transport.abort()
            return False
        except ssl.SSLError as error:
            seldom.warning(self._host, "%s: no TLS: %s", self._host, error.reason)
            self._flush()
            self._transport.close()
            return False
        self._flush()
        self._calm_down()
        self.inner = self._factory()
        self.inner.connection_made(cast(asyncio.BaseTransport, _Encrypted(self, self._transport)))
        return True

    def _read(self) -> None:
        """Pass received data on. Reading without data costs more than a message, so it is not attempted."""
        assert self._tunnel is not None
        incoming = self._incoming
        try:
            while incoming.pending and not self._gone():
                data = self._tunnel.read(RECORD_MAX)  # one complete record
                if not data:
                    if not self.eof_received():
                        self._end()
                    return
                assert self.inner is not None
                self.inner.data_received(data)
        except ssl.SSLWantReadError:
            pass  # an incomplete record
        except ssl.SSLError as error:
            if not isinstance(error, ssl.SSLZeroReturnError):
                log.info("%s: TLS broke: %s", self._host, error.reason)
            self._end()
            return
        if self._outgoing.pending:
            self._reply()

    def _reply(self) -> None:
        """Send TLS's own replies; disconnect a peer that causes too many of them."""
        self._replied += self._outgoing.pending
        if self._replied > REPLIES_MAX:
            seldom.warning(self._host, "%s cut off: too many new keys or handshakes in a connection", self._host)
            self._transport.abort()
        else:
            self._flush()

    def _end(self) -> None:
        self._flush()
        self._transport.close()

    def _flush(self) -> None:
        if self._outgoing.pending:
            self._transport.write(self._outgoing.read())

    def _calm_down(self) -> None:
        if self._timeout is not None:
            self._timeout.cancel()
            self._timeout = None


class TlsPort(TlsEnd):
    """An incoming connection. ``admit`` decides by the client's host, before the handshake."""

    def __init__(self, factory: Factory, tls: Tls, admit: Callable[[str], bool] = lambda _host: True) -> None:
        super().__init__(factory)
        self._tls, self._admit = tls, admit

    def data_received(self, data: bytes) -> None:
        """Tell TLS from plain by the first byte; then decrypt."""
        if self._tunnel is not None or self._begin(data):
            super().data_received(data)

    def _begin(self, data: bytes) -> bool:
        """Return whether TLS begins; pass plain connections to their protocol."""
        if data[0] != HELLO:
            self._calm_down()
            if not self._tls.plain:
                seldom.warning(self._host, "%s turned away: this port takes TLS only", self._host)
                self._transport.abort()
                return False
            inner = self._factory()
            self._transport.set_protocol(inner)
            inner.connection_made(self._transport)
            inner.data_received(data)
            return False
        if not self._admit(self._host):
            seldom.warning(self._host, "%s turned away: too many TLS handshakes", self._host)
            self._transport.abort()
            return False
        self._encrypt(self._tls.context, server_side=True)
        return True


class TlsCall(TlsEnd):
    """An outgoing connection; ``over`` is done after the handshake, or fails with ConnectionError.

    ``name``: expected name in the other end's certificate, if ``context`` checks names.
    """

    def __init__(self, factory: Factory, context: ssl.SSLContext, name: str = "") -> None:
        super().__init__(factory)
        self._encryption, self._name = context, name
        self.over: asyncio.Future[asyncio.Protocol] = asyncio.get_running_loop().create_future()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin the handshake."""
        super().connection_made(transport)
        self._encrypt(self._encryption, server_side=False, name=self._name or None)
        self._shake_hands(0)

    def connection_lost(self, exc: Exception | None) -> None:
        """Notify the inner protocol and the waiter."""
        super().connection_lost(exc)
        if not self.over.done():
            self.over.set_exception(ConnectionError(f"no TLS with {self._host}: {exc or 'it hung up'}"))

    def _shake_hands(self, size: int) -> bool:
        shaken = super()._shake_hands(size)
        if shaken and self.inner is not None and not self.over.done():
            self.over.set_result(self.inner)
        return shaken


class _Encrypted:
    """Transport of the inner protocol."""

    def __init__(self, end: TlsEnd, transport: asyncio.Transport) -> None:
        self._end, self._transport = end, transport
        self.write, self.is_closing = end.send, transport.is_closing  # bound once: called for every message

    def writelines(self, pieces: list[bytes]) -> None:
        self._end.send(b"".join(pieces))

    def write_eof(self) -> None:
        self.close()

    def can_write_eof(self) -> bool:
        return False

    def close(self) -> None:
        self._end.say_goodbye()
        self._transport.close()

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        self._end.inner = cast(asyncio.Protocol, protocol)

    def get_protocol(self) -> asyncio.BaseProtocol | None:
        return self._end.inner

    def get_extra_info(self, name: str, default: object = None) -> object:
        match name:
            case "sslcontext":
                return self._end.tunnel.context if self._end.tunnel else default
            case "ssl_object":
                return self._end.tunnel
        return self._transport.get_extra_info(name, default)

    def __getattr__(self, name: str) -> object:
        return getattr(self._transport, name)
