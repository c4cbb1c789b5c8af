"""WebSocket server for doors: connections, limits and admission; the door makes a session for each path.

The `websockets` library frames messages, the door interprets them.
"""

from __future__ import annotations

import asyncio
import importlib
import logging
from collections.abc import Awaitable
from contextvars import copy_context
from types import ModuleType
from typing import TYPE_CHECKING, cast

from roboglot.model.admission import Admission
from roboglot.model.background import load
from roboglot.model.client_context import set_client
from roboglot.protocols.browsers import Browsers
from roboglot.protocols.channels import Channel, Session
from roboglot.protocols.gate import Gate
from roboglot.protocols.websocket_opening import Entrance, Opened, Opening
from roboglot.protocols.websocket_writer import Writer
from roboglot.transport.tls import Tls

if TYPE_CHECKING:
    from websockets.server import ServerProtocol

log = logging.getLogger(__name__)

LIBRARY = "websockets.server"
"""Loaded in the background once the port is open, so that the door starts as fast as without it."""
CONNECTIONS_MAX = 32
PENDING_MAX = 16  # messages of one connection in progress, beside the rest of a portion
PORTION = 1024  # bytes that are read at a time: 170 frames, if they are empty
READ_SECONDS = 0.002  # of reading from one connection, then others are served
REASON_BYTES_MAX = 123  # of a close frame
GOING_AWAY, UNSUPPORTED, NOT_UTF8, POLICY, TRY_LATER = 1001, 1003, 1007, 1008, 1013  # close codes of RFC 6455


class WebSocketServer:
    """Listens at ``address`` and ``port`` (0: any free port) from ``start`` to ``close``.

    Pages of other hosts are refused, since any page may open a WebSocket; ``browsers`` has the exceptions.
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
        self.admission = admission or Admission()
        self.scheme = "wss" if tls else "ws"
        self._gate = Gate(self.admission, tls)
        self.address = address
        self.port = port
        self.entrance = Entrance(door, channels, browsers or Browsers(f"[{door}]"), self.admission)
        self.connections: set[Connection] = set()
        self._server: asyncio.Server | None = None
        self._loading: asyncio.Task[ModuleType] | None = None

    async def start(self) -> None:
        """Listen. Raises OSError naming an address that is taken."""
        self.entrance.browsers.warn_if_open()
        self._leave = self.admission.on_lost(self._disconnect)
        loop = asyncio.get_running_loop()
        name, most = f"{self.entrance.door} WebSocket", CONNECTIONS_MAX
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
        self.identity = ""  # the account's, where admission requires one
        self.subprotocol = ""  # the negotiated one
        self.writer = Writer()
        self._opening = Opening(server.entrance, self.writer, self._wait_for, self._begin)
        self._protocol: ServerProtocol | None = None  # set once open
        self._unread = bytearray()
        self._turn: asyncio.Handle | None = None  # in which reading goes on
        self._pieces = bytearray()
        self._channel: Channel | None = None
        self._session: Session | None = None
        self._binary = False  # fragments of a message
        self._pending: set[asyncio.Future[None]] = set()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Register the connection, or abort it if there are too many."""
        self._transport = cast(asyncio.Transport, transport)
        peer = transport.get_extra_info("peername") or ("", 0)  # None: already disconnected
        self._host = peer[0]
        self._name = f"{peer[0]}:{peer[1]}"
        self.writer.connect(self._transport, self._name)
        self._opening.begin(self._host, self._name)
        if len(self._server.connections) >= CONNECTIONS_MAX:
            self._transport.abort()
        else:
            self._server.connections.add(self)

    def data_received(self, data: bytes) -> None:
        """Read the request, then messages."""
        if self._protocol is None:
            self._opening.receive(data)
        else:
            self._unread += data
            if self._turn is None:
                self._read_on()

    def connection_lost(self, _exc: Exception | None) -> None:
        """Drop the client; its requests in progress are finished nevertheless."""
        self._opening.close()
        self._transport = None
        self._unread.clear()
        self._server.connections.discard(self)
        session, self._session = self._session, None
        if session is not None:
            session.close()
        self.writer.lose()

    def pause_writing(self) -> None:
        """Make programs wait: the transport's buffer is full."""
        self.writer.pause()

    def resume_writing(self) -> None:
        """Let programs continue: the transport's buffer has room."""
        self.writer.resume()

    async def drain(self) -> None:
        """Wait until the client has caught up."""
        await self.writer.drain()

    @property
    def name(self) -> str:
        """Address and port of the client."""
        return self._name

    @property
    def who(self) -> str:
        """Name of the client, as in control leases."""
        return f"{self._server.entrance.door} {self.identity or self._host}"

    @property
    def unsent(self) -> int:
        """Number of bytes that the client has yet to read."""
        return self.writer.unsent

    def send(self, message: str | bytes) -> None:
        """Send one message, a text or bytes; disconnect a client that does not read."""
        if self._protocol is None or not self.writer.may_write():
            return
        if isinstance(message, str):
            self._protocol.send_text(message.encode("utf-8", "replace"))
        else:
            self._protocol.send_binary(message)
        self.writer.flush(self._protocol)

    def leave(self, code: int, reason: str = "") -> None:
        """Close the connection, with a close frame once it is open."""
        if self._protocol is not None and not self.writer.closing:
            self._protocol.fail(code, reason.encode()[:REASON_BYTES_MAX].decode("utf-8", "ignore"))
            self.writer.flush(self._protocol)
        self.writer.close()

    def _begin(self, opened: Opened) -> None:
        """Open the channel for an admitted client."""
        self.identity, self._channel, self._protocol = opened.identity, opened.channel, opened.protocol
        self.subprotocol = opened.protocol.subprotocol or ""
        try:
            self._session = copy_context().run(self._open_session, opened.channel)
        except RuntimeError as full:
            self.leave(TRY_LATER, str(full))
            return
        if opened.early:
            self.data_received(opened.early)

    def _open_session(self, channel: Channel) -> Session:
        set_client(self.who, self._name, self.identity)
        return channel.open(self)

    def _read_on(self) -> None:
        """Read for READ_SECONDS, and the rest in further turns of the loop; wait while PENDING_MAX are answered."""
        self._turn, loop = None, asyncio.get_running_loop()
        if self._transport is None or self._protocol is None:
            return
        until = loop.time() + READ_SECONDS
        while self._unread and len(self._pending) < PENDING_MAX:
            portion = bytes(self._unread[:PORTION])
            del self._unread[:PORTION]
            self._read(self._protocol, portion)
            if self.writer.closing:
                self._unread.clear()
            if loop.time() >= until:
                break
        waits = len(self._pending) >= PENDING_MAX
        if self._unread and not waits:
            self._turn = loop.call_soon(self._read_on)
        if self._unread or waits:
            self._transport.pause_reading()
        elif not self._transport.is_closing():
            self._transport.resume_reading()

    def _read(self, protocol: ServerProtocol, data: bytes) -> None:
        """Handle complete messages; the library answers pings, close frames and broken frames."""
        from websockets.frames import Frame, Opcode

        protocol.receive_data(data)
        for frame in protocol.events_received():
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
        self.writer.flush(protocol)

    def _answer(self, message: str | bytes) -> None:
        """Answer in the background, as an answer may wait for a program to start."""
        if self._session is None:
            return
        self._in_background(self._receive(self._session, message))

    async def _receive(self, session: Session, message: str | bytes) -> None:
        set_client(self.who, self._name, self.identity)
        await session.receive(message)

    def _wait_for(self, work: Awaitable[None]) -> None:
        """Read on when it is done."""
        if self._transport is not None:
            self._transport.pause_reading()
        self._in_background(work)

    def _in_background(self, work: Awaitable[None]) -> None:
        task = asyncio.ensure_future(work)
        self._pending.add(task)
        task.add_done_callback(self._finished)

    def _finished(self, task: asyncio.Future[None]) -> None:
        self._pending.discard(task)
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("cannot answer %s: %s", self._name, error, exc_info=error)
            if self._protocol is None:  # it was not admitted, and would wait for ever
                self.writer.abort()
        if self._transport is not None and not self._transport.is_closing() and len(self._pending) < PENDING_MAX:
            if self._protocol is None:
                self._transport.resume_reading()
            elif self._turn is None:
                self._read_on()
