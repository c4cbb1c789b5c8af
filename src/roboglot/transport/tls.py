"""TLS in front of any protocol, on a port that takes plain connections, too: the first byte decides.

The handshake is asked for before it costs anything, and ends within HANDSHAKE_SECONDS_MAX. Works over every loop's
transports, and needs none of their own TLS, which begins before anything can be asked.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import ssl
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from roboglot.transport.seldom import Seldom

log = logging.getLogger(__name__)
seldom = Seldom(log)

HANDSHAKE_SECONDS_MAX = 5.0
HANDSHAKE_BYTES_MAX = 64 * 1024  # from the client, until the handshake is over
PIECE = 64 * 1024
HELLO = 0x16  # the first byte of a TLS connection: a handshake record

Factory = Callable[[], asyncio.Protocol]


@dataclass(frozen=True, slots=True)
class Tls:
    """How a port encrypts. ``plain``: it also takes connections that are not encrypted."""

    context: ssl.SSLContext
    plain: bool = True


def server_context(certificate: Path, key: Path, oldest: ssl.TLSVersion = ssl.TLSVersion.TLSv1_2) -> ssl.SSLContext:
    """Return a server's context without renegotiation, compression and resumption. Raises OSError, ssl.SSLError."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = oldest
    context.options |= ssl.OP_NO_RENEGOTIATION | ssl.OP_NO_COMPRESSION | ssl.OP_NO_TICKET
    context.num_tickets = 0
    context.load_cert_chain(certificate, key)
    return context


class TlsPort(asyncio.Protocol):
    """One connection. ``admit`` is asked with the client's host before a handshake."""

    def __init__(self, factory: Factory, tls: Tls, admit: Callable[[str], bool] = lambda _host: True) -> None:
        self._factory, self._tls, self._admit = factory, tls, admit
        self.inner: asyncio.Protocol | None = None
        self._transport: asyncio.Transport
        self._incoming, self._outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        self._tunnel: ssl.SSLObject | None = None
        self._received = 0
        self._host = ""
        self._patience: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Wait for the first byte."""
        self._transport = cast(asyncio.Transport, transport)
        self._host = (transport.get_extra_info("peername") or ("",))[0]
        self._patience = asyncio.get_running_loop().call_later(HANDSHAKE_SECONDS_MAX, self._transport.abort)

    def data_received(self, data: bytes) -> None:
        """Find out what it is; then decrypt."""
        if self._tunnel is None and not self._begin(data):
            return
        self._incoming.write(data)
        if self.inner is None and not self._shake_hands(len(data)):
            return
        self._read()

    def eof_received(self) -> bool | None:
        """The client sends no more."""
        if self.inner is None:
            return False
        self.inner.eof_received()
        return False

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
        assert self._tunnel is not None
        if data and not self._transport.is_closing():
            self._tunnel.write(data)
            self._flush()

    def say_goodbye(self) -> None:
        """Signal the end to the client."""
        if self._tunnel is not None and not self._transport.is_closing():
            with contextlib.suppress(ssl.SSLError):
                self._tunnel.unwrap()
            self._flush()

    @property
    def tunnel(self) -> ssl.SSLObject | None:
        """The encryption; None: there is none yet."""
        return self._tunnel

    def _begin(self, data: bytes) -> bool:
        """Whether it is TLS and may be; plain connections go to their protocol."""
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
        self._tunnel = self._tls.context.wrap_bio(self._incoming, self._outgoing, server_side=True)
        return True

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
        assert self._tunnel is not None
        try:
            while not self._transport.is_closing():
                data = self._tunnel.read(PIECE)
                if not data:
                    break
                assert self.inner is not None
                self.inner.data_received(data)
            else:
                return
        except ssl.SSLWantReadError:
            self._flush()
            return
        except ssl.SSLError as error:
            if not isinstance(error, ssl.SSLZeroReturnError):
                log.info("%s: TLS broke: %s", self._host, error.reason)
        self._flush()
        self._transport.close()

    def _flush(self) -> None:
        if data := self._outgoing.read():
            self._transport.write(data)

    def _calm_down(self) -> None:
        if self._patience is not None:
            self._patience.cancel()
            self._patience = None


class _Encrypted:
    """The transport as the inner protocol sees it."""

    def __init__(self, port: TlsPort, transport: asyncio.Transport) -> None:
        self._port, self._transport = port, transport

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self._port.send(data)

    def writelines(self, pieces: list[bytes]) -> None:
        self._port.send(b"".join(pieces))

    def write_eof(self) -> None:
        self.close()

    def can_write_eof(self) -> bool:
        return False

    def close(self) -> None:
        self._port.say_goodbye()
        self._transport.close()

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        self._port.inner = cast(asyncio.Protocol, protocol)

    def get_protocol(self) -> asyncio.BaseProtocol | None:
        return self._port.inner

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        match name:
            case "sslcontext":
                return self._port.tunnel.context if self._port.tunnel else default
            case "ssl_object":
                return self._port.tunnel
        return self._transport.get_extra_info(name, default)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)
