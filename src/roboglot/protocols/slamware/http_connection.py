"""One HTTP connection: uvicorn's httptools protocol with the vendor's reason phrases and hard limits.

Loaded, with uvicorn, for a door's first client. Knows neither the robot nor the API. Its times are real time, as they
guard sockets.

A request that repeats an earlier one, byte for byte, is answered without parser, ASGI and task if the application
offers that (``fast_path``).
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol, cast

import httptools
from uvicorn.config import Config
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol
from uvicorn.server import ServerState

from roboglot.protocols.slamware.bodies import Scope
from roboglot.protocols.slamware.config import CONNECTIONS_MAX
from roboglot.protocols.slamware.errors import REASON
from roboglot.transport.outlet import Outlet

HEAD_MAX = 32 * 1024  # bytes of a request's line and headers
PIECE = 1 << 20  # bytes of a body
JOINED_MAX = 1 << 16  # bytes of a body that is sent with its head
REQUEST_SECONDS_MAX = 10.0  # for a request (or a piece of its body) to arrive, and for a new connection's first one
WRITE_SECONDS_MAX = 30.0  # for a client that does not read its answer
KEEP_ALIVE_SECONDS = 75
REPEATED_MAX, REPEATED_BYTES_MAX = 8, 1024  # requests of a connection that are known by their bytes, and these

_REASON_LINE = b"\r\n" + REASON + b": "
_STATUS = b"HTTP/1.1 "
_CONTINUE = _STATUS + b"100 "
_CODE_END = len(_STATUS) + 4
_TOO_LARGE = (
    b"HTTP/1.1 431 Request Header Fields Too Large\r\ncontent-type: text/plain; charset=utf-8\r\n"
    b"content-length: 31\r\nconnection: close\r\n\r\nRequest Header Fields Too Large"
)


class Answering(Protocol):
    """ASGI application that may answer repeated requests directly."""

    def fast_path(self, scope: Scope) -> Callable[[], bytes | None] | None:
        """Return a function that returns the whole response to a repetition, or None if that must be parsed."""


class ReasonTransport(Outlet):
    """Transport that moves the header REASON of a response into its status line.

    It keeps the head of a response until the loop's next turn, to send it with the body: one write and one packet are
    quicker than two.
    """

    def __init__(self, transport: asyncio.Transport) -> None:
        super().__init__(transport)
        self._head = b""

    def close(self) -> None:
        self.flush()
        super().close()

    def write(self, data: bytes | bytearray | memoryview[object]) -> None:
        """Send ``data``; keep a response's head, which is always one piece, until its body comes."""
        if isinstance(data, bytes) and data.startswith(_STATUS) and not data.startswith(_CONTINUE):
            self.flush()
            self._head = with_reason(data)
            asyncio.get_running_loop().call_soon(self.flush)  # if the body comes later
        elif self._head and len(data) <= JOINED_MAX:
            head, self._head = self._head, b""
            super().write(head + data)
        else:
            self.flush()
            super().write(data)

    def send(self, response: bytes) -> None:
        """Send a whole response."""
        self.flush()
        super().write(response)

    def flush(self) -> None:
        """Send a head whose response has no body, or a large one."""
        if self._head:
            head, self._head = self._head, b""
            super().write(head)


def with_reason(head: bytes) -> bytes:
    """Move the header REASON of a response's head into its status line."""
    at = head.find(_REASON_LINE)
    if at < 0:
        return head
    end = head.index(b"\r\n", at + 2)
    reason = head[at + len(_REASON_LINE) : end]
    return head[:_CODE_END] + reason + head[head.index(b"\r\n") : at] + head[end:]


def send_last(transport: asyncio.Transport, response: bytes) -> None:
    """Send a response and close."""
    transport.write(response)
    transport.close()


class HeadTooLong(Exception):
    """Aborts parsing; never leaves this module."""


class HttpConnection(HttpToolsProtocol):
    """HTTP connection with limits on number, duration and size."""

    _timeout: asyncio.TimerHandle | None = None
    _deadline: float | None = None  # by the loop's clock; None: no deadline
    _receiving = False  # between the first byte of a request and its last
    _in_head = False
    _head_bytes = 0  # received while the headers are incomplete
    _body_bytes = 0  # since the deadline was last extended
    _parsed_bytes = 0  # of these, parsed: long headers may arrive at once
    _reading: bytes | memoryview = b""
    _unread: Sequence[bytes | memoryview] = ()  # received, to be parsed first
    _begun = 0  # requests in the last received data
    _idle = True  # no request is partly received or unanswered
    _whole, _last = b"", b""  # the request in progress if it came in one piece, and the one before
    _answered_again = False  # since the keep-alive's timer was set
    _refusal: Callable[[], None] | None = None  # sends an error after the answers in progress

    def __init__(self, application: Answering, config: Config, state: ServerState) -> None:
        super().__init__(config, state, {}, asyncio.get_running_loop())
        self._application = application
        self._said: dict[bytes, Callable[[], bytes | None]] = {}

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        reasoned = ReasonTransport(cast(asyncio.Transport, transport))
        super().connection_made(reasoned)
        if len(self.connections) > CONNECTIONS_MAX:
            reasoned.abort()
            return
        self._guard(REQUEST_SECONDS_MAX)

    def connection_lost(self, exc: Exception | None) -> None:
        self._guard(None)
        if self._timeout is not None:
            self._timeout.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if self._idle and (repeated := self._said.get(data)) is not None and (response := repeated()) is not None:
            self._answered_again = True
            cast(ReasonTransport, self.transport).send(response)
        else:
            self._read(data)

    def _read(self, data: bytes) -> None:
        if self._refusal is not None:
            return
        idle, self._idle = self._idle, False
        self._begun, self._whole = 0, b""
        unread: list[bytes | memoryview] = [data]
        while unread:
            self._reading = unread.pop(0)
            super().data_received(self._reading)  # type: ignore[arg-type] # the parser reads any buffer
            if self._in_head:
                self._head_bytes += len(self._reading)
                if self._head_bytes > HEAD_MAX:
                    self._refuse(partial(send_last, self.transport, _TOO_LARGE))
            unread, self._unread = [*self._unread, *unread], ()
        if idle and self._begun == 1 and not self._receiving and len(data) <= REPEATED_BYTES_MAX:
            self._whole = data

    def send_400_response(self, msg: str) -> None:
        """Refuse a request that cannot be parsed, or that ``_measure`` aborted; called by uvicorn."""
        if self._parsed_bytes > HEAD_MAX:
            self._refuse(partial(send_last, self.transport, _TOO_LARGE))
        else:
            self._refuse(partial(super().send_400_response, msg))

    def on_url(self, url: bytes) -> None:
        self._measure(len(url))
        super().on_url(url)

    def on_header(self, name: bytes, value: bytes) -> None:
        self._measure(len(name) + len(value))
        if self._in_head:  # a trailer is ignored: the request may have been answered
            super().on_header(name, value)

    def _measure(self, more: int) -> None:
        """Count bytes of the head, and abort parsing when there are too many."""
        self._parsed_bytes += more
        if self._parsed_bytes > HEAD_MAX:
            raise HeadTooLong

    def _refuse(self, refusal: Callable[[], None]) -> None:
        """Refuse the arriving request, after the answers to earlier ones."""
        if self._receiving and not self._in_head:  # its body is malformed; it is in progress, or the last in the queue
            answering = bool(self.pipeline)
            if answering:
                self.pipeline.popleft()
        else:
            answering = self.cycle is not None and not self.cycle.response_complete
        if answering:
            self._refusal = refusal
            self._guard(WRITE_SECONDS_MAX)
        elif not self.transport.is_closing():
            refusal()

    def _should_upgrade(self) -> bool:
        """Have uvicorn call ``handle_websocket_upgrade`` for a request to switch protocols."""
        return True

    def handle_websocket_upgrade(self) -> None:
        """Parse the request again without its upgrade: there is no other protocol.

        Java's client offers HTTP/2 in every request, and the parser would take the body for that protocol.
        """
        upgrade = sys.exception()
        assert isinstance(upgrade, httptools.HttpParserUpgrade)
        method, version = self.parser.get_method(), self.parser.get_http_version()
        if method == b"CONNECT":
            self.send_400_response("Invalid HTTP request received.")
            return
        head = [b"%s %s HTTP/%s" % (method, self.url, version.encode())]
        for name, value in self.headers:
            if name == b"connection":
                value = b", ".join(v.strip() for v in value.split(b",") if v.strip().lower() != b"upgrade")
            if name != b"upgrade":
                head.append(name + b": " + value)
        self.parser = httptools.HttpRequestParser(self)
        self._unread = [b"\r\n".join(head) + b"\r\n\r\n", memoryview(self._reading)[upgrade.args[0] :]]

    def on_message_begin(self) -> None:
        self._begun += 1
        self._receiving = self._in_head = True
        self._head_bytes = self._parsed_bytes = self._body_bytes = 0
        self._guard(REQUEST_SECONDS_MAX)
        super().on_message_begin()

    def on_headers_complete(self) -> None:
        self._in_head = False
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        self._body_bytes += len(body)
        if self._body_bytes >= PIECE:  # uploads may be slow as long as data arrives
            self._body_bytes = 0
            self._guard(REQUEST_SECONDS_MAX)
        super().on_body(body)

    def on_message_complete(self) -> None:
        self._receiving = False
        self._guard(None)
        super().on_message_complete()

    def on_response_complete(self) -> None:
        assert isinstance(self.transport, ReasonTransport)
        self.transport.flush()  # the answer to a HEAD has no body
        if self._refusal is not None and not self.pipeline and not self.transport.is_closing():
            self._refusal()
        super().on_response_complete()
        self._answered_again = False
        if not (self._receiving or self.pipeline or self.flow.write_paused or self.transport.is_closing()):
            self._idle = True
            if self._whole and self._whole == self._last:
                self._learn(self._whole)
            self._last = self._whole

    def eof_received(self) -> bool:  # type: ignore[override] # uvicorn drops pending answers to a client that sends no more
        """Close after the answers under way; return True until then."""
        if not self._receiving:
            self.shutdown()
        return not (self._receiving or self.transport.is_closing())

    def _learn(self, request: bytes) -> None:
        """Cache the function that answers this request, which came twice in a row."""
        if self.cycle.keep_alive and (repeated := self._application.fast_path(cast(Scope, self.scope))) is not None:
            if len(self._said) >= REPEATED_MAX:
                self._said.clear()
            self._said[request] = repeated

    def timeout_keep_alive_handler(self) -> None:
        if self._answered_again:
            self._answered_again = False
            self.timeout_keep_alive_task = self.loop.call_later(
                self.timeout_keep_alive, self.timeout_keep_alive_handler
            )
        else:
            super().timeout_keep_alive_handler()

    def pause_writing(self) -> None:
        self._idle = False
        self._guard(WRITE_SECONDS_MAX)
        super().pause_writing()

    def resume_writing(self) -> None:
        self._guard(REQUEST_SECONDS_MAX if self._receiving else None)
        super().resume_writing()

    def _guard(self, seconds: float | None) -> None:
        """Drop the connection in ``seconds`` unless called again; None: no deadline."""
        # One timer stays armed, however many requests arrive: two timers per request cost as much as its answer.
        self._deadline = None if seconds is None else self.loop.time() + seconds
        if self._deadline is None or (self._timeout is not None and self._timeout.when() <= self._deadline):
            return
        if self._timeout is not None:
            self._timeout.cancel()
        self._timeout = self.loop.call_at(self._deadline, self._on_timeout)

    def _on_timeout(self) -> None:
        self._timeout = None
        if self._deadline is None:
            return
        if self._deadline > self.loop.time():
            self._timeout = self.loop.call_at(self._deadline, self._on_timeout)
        else:
            self.transport.abort()


class HttpConnections:
    """All connections to one application, and their requests in progress."""

    def __init__(self, application: Answering) -> None:
        self._application = application
        self._config = Config(
            cast(Callable[..., object], application),
            http=HttpConnection,
            ws="none",
            lifespan="off",
            interface="asgi3",
            log_config=None,
            access_log=False,
            proxy_headers=False,
            timeout_keep_alive=KEEP_ALIVE_SECONDS,
        )
        self._config.load()
        self._state = ServerState()

    def add(self) -> HttpConnection:
        """Return the protocol of a new connection."""
        return HttpConnection(self._application, self._config, self._state)

    @property
    def open(self) -> list[HttpConnection]:
        """Open connections."""
        return [connection for connection in self._state.connections if isinstance(connection, HttpConnection)]

    @property
    def tasks(self) -> set[asyncio.Task[None]]:
        """Requests in progress."""
        return self._state.tasks
