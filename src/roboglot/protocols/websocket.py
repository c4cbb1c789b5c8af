"""WebSockets for doors: connections, limits and admission; each path leads to a session that the door makes.

Bytes are the `websockets` library's business, the meaning of a message the door's.
"""

from __future__ import annotations

import asyncio
import importlib
import logging
from collections.abc import Awaitable
from contextvars import copy_context
from http import HTTPStatus
from types import ModuleType
from typing import TYPE_CHECKING, cast

from roboglot.model.admission import NO_PROOF, Admission, Forbidden, Proof, ProofKind, Right, Unknown
from roboglot.model.background import load
from roboglot.model.client_context import ask_for
from roboglot.protocols.browsers import Browsers, of_texts
from roboglot.protocols.channels import Channel, Session
from roboglot.protocols.gate import Gate
from roboglot.transport.tls import Tls

if TYPE_CHECKING:
    from websockets.http11 import Request
    from websockets.server import ServerProtocol

log = logging.getLogger(__name__)

LIBRARY = "websockets.server"
"""Loaded in the background once the port is open, so that the door starts as fast as without it."""
CONNECTIONS_MAX = 32
PENDING_MAX = 16  # texts of one connection that are being answered
OPENING_MAX = 8192  # bytes of a request
MESSAGE_MAX = 8 * 1024 * 1024  # bytes of a text, whole or in pieces
UNSENT_MAX = 16 * 1024 * 1024  # bytes waiting for a slow reader; at the next text it is disconnected
ROOM = 256 * 1024  # bytes waiting for a slow reader before programs wait for it
STALLED_SECONDS_MAX = 10.0  # in which such a reader takes nothing at all; then it is disconnected
OPENING_SECONDS_MAX = 10.0
HEAD_END = b"\r\n\r\n"
REASON_BYTES_MAX = 123  # of a close frame
GOING_AWAY, UNSUPPORTED, NOT_UTF8, POLICY, TRY_LATER = 1001, 1003, 1007, 1008, 1013  # close codes of RFC 6455


class WebSocketServer:
    """Listens at ``address`` and ``port`` (0: any free port) from ``start`` to ``close``.

    Web pages of other hosts are refused, since any page may open a WebSocket; ``browsers`` knows the exceptions.
    """

    def __init__(
        self,
        channels: dict[str, Channel],
        address: str,
        port: int,
        browsers: Browsers | None = None,
        admission: Admission | None = None,
        tls: Tls | None = None,
        door: str = "visual",
    ) -> None:
        self.door = door
        self.admission = admission or Admission()
        self.scheme = "wss" if tls else "ws"
        self._gate = Gate(self.admission, tls)
        self.channels = channels
        self.address = address
        self.port = port
        self.browsers = browsers or Browsers(f"[{door}]")
        self.connections: set[Connection] = set()
        self._server: asyncio.Server | None = None
        self._loading: asyncio.Task[ModuleType] | None = None

    async def start(self) -> None:
        """Listen. Raises OSError naming an address that is taken."""
        self.browsers.warn_if_open()
        self._leave = self.admission.on_lost(self._disconnect)
        loop = asyncio.get_running_loop()
        name, most = f"{self.door} WebSocket", CONNECTIONS_MAX
        self._server = await self._gate.listen(lambda: Connection(self), name, self.address, self.port, None, most)
        self.port = self._server.sockets[0].getsockname()[1]
        self._loading = loop.create_task(load(lambda: importlib.import_module(LIBRARY)), name="WebSocket library")

    async def close(self) -> None:
        """Stop listening and close every connection."""
        if self._server is not None:
            self._server.close()
            self._leave()
            self._gate.close()
        for connection in tuple(self.connections):
            connection.leave(GOING_AWAY, "the robot goes away")
        if self._server is not None:
            await self._server.wait_closed()
            self._server = None
        if self._loading is not None:
            await self._loading

    def _disconnect(self, who: str) -> None:
        for connection in tuple(self.connections):
            if connection.identity == who:
                connection.leave(POLICY, "your rights have changed")


class Connection(asyncio.Protocol):
    """One client, from its request to its end."""

    def __init__(self, server: WebSocketServer) -> None:
        self._server = server
        self._transport: asyncio.Transport | None = None
        self._host = ""
        self._name = ""  # host and port
        self.identity = ""  # of the account, where admission asks for one
        self.subprotocol = ""  # the one of the channel's that was agreed on
        self._head = bytearray()
        self._early = b""  # received after the request, before it was accepted
        self._protocol: ServerProtocol | None = None
        self._open = False
        self._pieces = bytearray()
        self._channel: Channel | None = None
        self._session: Session | None = None
        self._binary = False  # the message that comes in pieces
        self._pending: set[asyncio.Future[None]] = set()
        self._has_room = asyncio.Event()
        self._has_room.set()
        self._written = 0  # bytes
        self._stall_timer: asyncio.TimerHandle | None = None
        self._opening_timer = asyncio.get_running_loop().call_later(OPENING_SECONDS_MAX, self._abort)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Count the connection in, or abort it where there are too many."""
        self._transport = cast(asyncio.Transport, transport)
        self._transport.set_write_buffer_limits(high=ROOM)
        peer = transport.get_extra_info("peername") or ("", 0)  # none: it is gone already
        self._host = peer[0]
        self._name = f"{peer[0]}:{peer[1]}"
        if len(self._server.connections) >= CONNECTIONS_MAX:
            self._transport.abort()
        else:
            self._server.connections.add(self)

    def data_received(self, data: bytes) -> None:
        """Read the request, then messages."""
        if self._open:
            self._read(data)
        elif self._protocol is not None:
            self._early += data
        else:
            self._head += data
            self._read_request()

    def connection_lost(self, _exc: Exception | None) -> None:
        """Forget the client; what it asked for is finished nevertheless."""
        self._opening_timer.cancel()
        self._transport = None
        self._server.connections.discard(self)
        session, self._session = self._session, None
        if session is not None:
            session.close()
        self.resume_writing()

    def pause_writing(self) -> None:
        """Let programs wait: the client reads more slowly than they report."""
        self._has_room.clear()
        self._watch_reading()

    def resume_writing(self) -> None:
        """Let programs go on: the client has caught up, or is gone."""
        self._has_room.set()
        if self._stall_timer is not None:
            self._stall_timer.cancel()
            self._stall_timer = None

    async def room(self) -> None:
        """Wait until the client has caught up."""
        await self._has_room.wait()

    @property
    def name(self) -> str:
        """The other end's address with its port."""
        return self._name

    @property
    def who(self) -> str:
        """The client in words, as control has it."""
        return f"{self._server.door} {self.identity or self._host}"

    @property
    def unsent(self) -> int:
        """Bytes that wait for the client to read."""
        return 0 if self._transport is None else self._transport.get_write_buffer_size()

    def send(self, message: str | bytes) -> None:
        """Send one message, a text or bytes; disconnect a client that does not read."""
        if self._transport is None or self._transport.is_closing() or not self._open:
            return
        if self._transport.get_write_buffer_size() > UNSENT_MAX:
            self._give_up()
            return
        assert self._protocol is not None
        if isinstance(message, str):
            self._protocol.send_text(message.encode("utf-8", "replace"))
        else:
            self._protocol.send_binary(message)
        self._flush()

    def _watch_reading(self, taken_before: int = -1) -> None:
        """Disconnect a client that has taken nothing since the last time, else look again."""
        if self._transport is None or self._has_room.is_set():
            return
        taken = self._written - self._transport.get_write_buffer_size()
        if taken == taken_before:
            self._give_up()
        else:
            loop = asyncio.get_running_loop()
            self._stall_timer = loop.call_later(STALLED_SECONDS_MAX, self._watch_reading, taken)

    def _give_up(self) -> None:
        log.warning("disconnect %s: it does not read its frames", self._name)
        self._abort()

    def leave(self, code: int, reason: str = "") -> None:
        """Close the connection, with a close frame once it is open."""
        if self._transport is None:
            return
        if self._open and self._protocol is not None and not self._transport.is_closing():
            self._protocol.fail(code, reason.encode()[:REASON_BYTES_MAX].decode("utf-8", "ignore"))
            self._flush()
        self._transport.close()

    def _flush(self) -> None:
        """Write what the library has for the client; an empty piece means the end."""
        assert self._protocol is not None
        for data in self._protocol.data_to_send():
            if self._transport is None:
                return
            if data:
                self._written += len(data)
                self._transport.write(data)
            else:
                self._transport.close()

    def _read_request(self) -> None:
        """Answer the request once it is complete."""
        from websockets.http11 import Request
        from websockets.server import ServerProtocol

        head, end, rest = bytes(self._head).partition(HEAD_END)
        self._protocol = ServerProtocol(max_size=MESSAGE_MAX, logger=log.getChild("library"))
        if not end:
            if len(self._head) > OPENING_MAX:
                self._refuse(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, "the request is too long")
            else:
                self._protocol = None
            return
        self._opening_timer.cancel()
        self._early = rest
        self._protocol.receive_data(head + end)
        requests = self._protocol.events_received()
        if requests and isinstance(requests[0], Request):
            self._check_request(requests[0])
        elif self._transport is not None:  # not HTTP
            self._transport.close()

    def _check_request(self, request: Request) -> None:
        from websockets.typing import Subprotocol

        path = request.path.partition("?")[0]
        self._channel = self._server.channels.get(path)
        if self._channel is None:
            self._refuse(HTTPStatus.NOT_FOUND, f"there are {' and '.join(self._server.channels)}")
            return
        assert self._protocol is not None
        self._protocol.available_subprotocols = [Subprotocol(name) for name in self._channel.subprotocols] or None
        response = self._protocol.accept(request)
        headers = {name.lower(): value for name, value in request.headers.raw_items()}
        if response.status_code != HTTPStatus.SWITCHING_PROTOCOLS:
            self._protocol.send_response(response)
            self._flush()
        elif refusal := self._server.browsers.refusal(of_texts(headers, "GET")):
            self._refuse(HTTPStatus.FORBIDDEN, refusal)
        elif not self._server.admission.asks:
            self._accept(request)
        else:
            self._authenticate(request, path, headers.get("authorization", ""))

    def _authenticate(self, request: Request, path: str, authorization: str) -> None:
        """Find out who it is, in the background where that is not known at once."""
        proof = Proof(ProofKind.HTTP, authorization) if authorization else NO_PROOF
        who = self._server.admission.known(self._name, proof)
        if who is not None:
            self._authorize(request, path, who)
            return
        assert self._transport is not None
        self._transport.pause_reading()
        self._in_background(self._admit(request, path, proof))

    async def _admit(self, request: Request, path: str, proof: Proof) -> None:
        try:
            who = await self._server.admission.admit(self._name, proof)
        except Unknown as unknown:
            self._refuse(HTTPStatus.UNAUTHORIZED, str(unknown), {"WWW-Authenticate": 'Basic realm="roboglot"'})
        else:
            self._authorize(request, path, who)

    def _authorize(self, request: Request, path: str, who: str) -> None:
        assert self._channel is not None
        self.identity = who
        try:
            copy_context().run(self._check_right, f"open {path}", self._channel.right)
        except Forbidden as forbidden:
            self._refuse(HTTPStatus.FORBIDDEN, str(forbidden))
        else:
            self._accept(request)

    def _check_right(self, operation: str, right: Right) -> None:
        """Raise Forbidden if the client lacks ``right``."""
        ask_for(self.who, self._name, self.identity)
        self._server.admission.check(self._server.door, operation, right)

    def _accept(self, request: Request) -> None:
        if self._transport is None:
            return
        assert self._protocol is not None
        assert self._channel is not None
        self._protocol.send_response(self._protocol.accept(request))
        self._flush()
        self._open, self.subprotocol = True, self._protocol.subprotocol or ""
        try:
            self._session = copy_context().run(self._open_session, self._channel)
        except RuntimeError as full:
            self.leave(TRY_LATER, str(full))
            return
        early, self._early = self._early, b""
        if early:
            self._read(early)

    def _open_session(self, channel: Channel) -> Session:
        ask_for(self.who, self._name, self.identity)
        return channel.open(self)

    def _refuse(self, status: HTTPStatus, reason: str, headers: dict[str, str] | None = None) -> None:
        if self._transport is None:
            return
        assert self._protocol is not None
        response = self._protocol.reject(status, f"{reason}\n")
        response.headers.update(headers or {})
        self._protocol.send_response(response)
        self._flush()

    def _read(self, data: bytes) -> None:
        """Take the messages that are complete; the library answers pings, goodbyes and broken frames."""
        from websockets.frames import Frame, Opcode

        assert self._protocol is not None
        self._protocol.receive_data(data)
        for frame in self._protocol.events_received():
            if not isinstance(frame, Frame) or frame.opcode.value >= Opcode.CLOSE.value:
                continue
            if frame.opcode is not Opcode.CONT:
                self._binary = frame.opcode is Opcode.BINARY
            if self._binary and not (self._channel is not None and self._channel.binary):
                self.leave(UNSUPPORTED, "frames are texts")
                return
            self._pieces += frame.data
            if frame.fin:
                message, self._pieces = bytes(self._pieces), bytearray()
                try:
                    self._answer(message if self._binary else message.decode())
                except UnicodeDecodeError:
                    self.leave(NOT_UTF8, "not UTF-8")
                    return
        self._flush()

    def _answer(self, message: str | bytes) -> None:
        """Answer in the background: that may take as long as a program takes to start."""
        if self._session is None:
            return
        self._in_background(self._receive(self._session, message))
        if len(self._pending) >= PENDING_MAX and self._transport is not None:
            self._transport.pause_reading()

    async def _receive(self, session: Session, message: str | bytes) -> None:
        ask_for(self.who, self._name, self.identity)
        await session.receive(message)

    def _in_background(self, work: Awaitable[None]) -> None:
        task = asyncio.ensure_future(work)
        self._pending.add(task)
        task.add_done_callback(self._finished)

    def _finished(self, task: asyncio.Future[None]) -> None:
        self._pending.discard(task)
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("cannot answer %s: %s", self._name, error, exc_info=error)
        if self._transport is not None and not self._transport.is_closing() and len(self._pending) < PENDING_MAX:
            self._transport.resume_reading()

    def _abort(self) -> None:
        if self._transport is not None:
            self._transport.abort()
