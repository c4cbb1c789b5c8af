"""HTTP/1.1 to one robot over a few kept connections. Knows no API.

No client library, because a driver makes thirty requests a second: a request takes half a millisecond here, and only
GET requests, which change nothing, are ever sent twice. h11 reads the answers: it is small, and needs no compiler.
"""

from __future__ import annotations

import asyncio
from dataclasses import field
from typing import cast

import h11

from roboglot.clients.errors import BadAnswer, LinkLost, TimedOut
from roboglot.model.clock import Clock
from roboglot.model.tap import Line
from roboglot.values import dataclass

CONNECTIONS_MAX = 6
HEAD_MAX = 32 * 1024  # bytes of an answer's status line and headers
BODY_MAX = 64 << 20  # bytes of an answer's body, each of six at once: the longest composite map
CONNECT_SECONDS_MAX = 3.0


@dataclass(slots=True)
class Answer:
    """Answer to a request. ``reason``: text of the status line, where Slamware robots put their explanation."""

    status: int = 0
    reason: str = ""
    content_type: str = ""
    body: bytearray = field(default_factory=bytearray)


class _Connection(asyncio.Protocol):
    """One connection, which carries one request at a time."""

    def __init__(self) -> None:
        self.transport: asyncio.Transport | None = None
        self.open = False
        self._answering: h11.Connection | None = None
        self._answer = Answer()
        self._waiting: asyncio.Future[Answer] | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport, self.open = cast(asyncio.Transport, transport), True  # uvloop's does not inherit from it

    def connection_lost(self, exc: Exception | None) -> None:
        if exc is None and self._answering is not None and self._answering.their_state is h11.SEND_BODY:
            self.data_received(b"")  # a body without a length ends with the connection
        self._fail(LinkLost(f"the connection broke: {exc}" if exc else "the robot hung up"))

    def data_received(self, data: bytes) -> None:
        if self._answering is None:
            self._fail(BadAnswer("the robot talks without being asked"))
            return
        try:
            self._answering.receive_data(data)
            while self._answering is not None and self._take(self._answering.next_event()):
                pass
        except h11.RemoteProtocolError as error:
            self._fail(LinkLost("the robot hung up") if not data else BadAnswer(f"not HTTP: {error}"))
        except BadAnswer as error:
            self._fail(error)

    async def ask(self, method: str, head: bytes, body: bytes) -> Answer:
        """Send a request and return the answer; cancelling the wait closes the connection."""
        assert self.transport is not None
        self._answering, self._answer = _awaiting_answer(method), Answer()
        self._waiting = asyncio.get_running_loop().create_future()
        self.transport.write(head + body if len(body) < HEAD_MAX else head)
        if len(body) >= HEAD_MAX:
            self.transport.write(body)
        try:
            return await self._waiting
        finally:
            if not self._waiting.done() or self._waiting.cancelled():
                self.abort()

    def abort(self) -> None:
        """Hang up now."""
        self.open = False
        if self.transport is not None:
            self.transport.abort()

    def _fail(self, error: Exception) -> None:
        self.abort()
        if self._waiting is not None and not self._waiting.done():
            self._waiting.set_exception(error)

    def _take(self, event: object) -> bool:
        """Take one part of the answer; return False if it was the last that is there. Raises BadAnswer."""
        match event:
            case h11.Response(status_code=status, reason=reason, headers=headers):
                if sum(len(name) + len(value) for name, value in headers) + len(reason) > HEAD_MAX:
                    raise BadAnswer(f"more than {HEAD_MAX} bytes of headers")
                self._answer.status, self._answer.reason = status, bytes(reason).decode("utf-8", "replace")
                self._answer.content_type = dict(headers).get(b"content-type", b"").decode("latin-1")
            case h11.Data(data=body):
                if len(self._answer.body) + len(body) > BODY_MAX:
                    raise BadAnswer(f"more than {BODY_MAX} bytes")
                self._answer.body += body
            case h11.EndOfMessage():
                self._finish()
                return False
        return event is not h11.NEED_DATA

    def _finish(self) -> None:
        answering, self._answering = self._answering, None
        assert answering is not None
        if answering.their_state is not h11.DONE or answering.trailing_data[0]:  # it does not keep the connection
            self.open = False
            if self.transport is not None:
                self.transport.close()
        if self._waiting is not None and not self._waiting.done():
            self._waiting.set_result(self._answer)


def _awaiting_answer(method: str) -> h11.Connection:
    """Return the state of a connection on which a request was sent; of methods, only HEAD changes what is answered."""
    connection = h11.Connection(h11.CLIENT, max_incomplete_event_size=HEAD_MAX)
    sent = "HEAD" if method == "HEAD" else "GET"  # h11 refuses what is no method, and a replay sends anything
    connection.send(h11.Request(method=sent, target="/", headers=[("host", "robot")]))
    connection.send(h11.EndOfMessage())
    return connection


class HttpLink:
    """At most ``CONNECTIONS_MAX`` connections to one host; timeouts are in the clock's time."""

    def __init__(self, host: str, port: int, clock: Clock) -> None:
        self.host, self.port = host, port
        self.line: Line | None = None  # records requests and answers
        self._clock = clock
        self._idle: list[_Connection] = []
        self._all: set[_Connection] = set()
        self._turns = asyncio.Semaphore(CONNECTIONS_MAX)

    async def ask(self, method: str, path: str, body: bytes, content_type: str, timeout: float) -> Answer:
        """Send a request and return its answer. Raises LinkLost, TimedOut, BadAnswer.

        A GET on a kept connection that was dead is sent once more on a new one; no other request is repeated.
        """
        try:
            return await self._clock.wait_for(self._ask(method, path, body, content_type), timeout)
        except TimeoutError:
            raise TimedOut(f"{self.host}:{self.port} did not answer {method} {path} within {timeout:g} s") from None

    async def _ask(self, method: str, path: str, body: bytes, content_type: str) -> Answer:
        head = (
            f"{method} {path} HTTP/1.1\r\nhost: {self.host}:{self.port}\r\naccept: application/json, */*\r\n"
            + (f"content-type: {content_type}\r\ncontent-length: {len(body)}\r\n" if body or method != "GET" else "")
            + "\r\n"
        ).encode("latin-1")
        async with self._turns:
            kept = self._kept()
            if kept is not None:
                try:
                    return await self._use(kept, method, head, body)
                except LinkLost:
                    if method != "GET":
                        raise
            return await self._use(await self._connect(), method, head, body)

    async def _use(self, connection: _Connection, method: str, head: bytes, body: bytes) -> Answer:
        try:
            answer = await connection.ask(method, head, body)
        finally:
            if connection.open:
                self._idle.append(connection)
            else:
                self._all.discard(connection)
        return answer

    def _kept(self) -> _Connection | None:
        while self._idle:
            connection = self._idle.pop()
            if connection.open:
                return connection
            self._all.discard(connection)
        return None

    async def _connect(self) -> _Connection:
        loop = asyncio.get_running_loop()
        try:
            _, connection = await self._clock.wait_for(
                loop.create_connection(_Connection, self.host, self.port), CONNECT_SECONDS_MAX
            )
        except TimeoutError:
            raise TimedOut(f"{self.host}:{self.port} does not answer") from None
        except OSError as error:
            raise LinkLost(f"{self.host}:{self.port} cannot be reached: {error.strerror or error}") from None
        self._all.add(connection)
        return connection

    def close(self) -> None:
        """Close all connections; pending requests raise LinkLost."""
        for connection in tuple(self._all):
            connection.abort()
        self._idle.clear()
        self._all.clear()
