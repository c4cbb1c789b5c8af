"""A WebSocket that carries the frames: texts at ``/programs``, and what programs print at ``/log``.

Knows connections; what is in a frame is the door's business. ``/log`` is ours, not the vendor's.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Awaitable, Callable
from contextvars import copy_context
from typing import cast

from roboglot.model.admission import NO_PROOF, Admission, Forbidden, Proof, ProofKind, Right, Unknown
from roboglot.model.client_context import ask_for
from roboglot.protocols.browsers import Browsers, of_texts
from roboglot.storage.programs import LogEntry
from roboglot.wire.visual.websocket import (
    OPENING_MAX,
    Broken,
    Message,
    MessageReader,
    Opcode,
    Opening,
    accept_of,
    encode,
    goodbye,
    parse_opening,
)

log = logging.getLogger(__name__)

CONNECTIONS_MAX = 32
PENDING_MAX = 16  # texts of one connection that are being answered
UNSENT_MAX = 16 * 1024 * 1024  # bytes waiting for a slow reader; at the next text it is cut off
OPENING_SECONDS_MAX = 10.0
BACKLOG = 64
Send = Callable[[str], None]


class Channel:
    """What a path of the WebSocket leads to. ``subscribe`` and ``receive`` are as in a ``FrameRelay``.

    ``right`` is what a client needs to open it.
    """

    def __init__(
        self,
        subscribe: Callable[[Send], Callable[[], None]],
        receive: Callable[[str, Send], Awaitable[None]],
        right: Right = Right.SEE,
    ) -> None:
        self.right = right
        self.subscribe = subscribe
        self.receive = receive


class WebSocketServer:
    """Listens at ``address`` and ``port`` (0: any that is free) from ``start`` to ``close``.

    Web pages of other hosts are turned away, for any page may open a WebSocket; ``browsers`` knows exceptions.
    """

    def __init__(
        self,
        channels: dict[str, Channel],
        address: str,
        port: int,
        browsers: Browsers | None = None,
        admission: Admission | None = None,
    ) -> None:
        self.admission = admission or Admission()
        self.channels = channels
        self.address = address
        self.port = port
        self.browsers = browsers or Browsers("[visual]")
        self.connections: set[Connection] = set()
        self._server: asyncio.Server | None = None

    async def start(self) -> None:
        """Listen. Raises OSError naming an address that is taken."""
        self.browsers.warn_if_open()
        self._leave = self.admission.on_lost(self._cut_off)
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(lambda: Connection(self), self.address, self.port, backlog=BACKLOG)
        self.port = self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """Stop listening, say goodbye to everybody."""
        if self._server is not None:
            self._server.close()
            self._leave()
        for connection in tuple(self.connections):
            connection.leave(1001, "the robot goes away")
        if self._server is not None:
            await self._server.wait_closed()
            self._server = None

    def _cut_off(self, who: str) -> None:
        for connection in tuple(self.connections):
            if connection.identity == who:
                connection.leave(1008, "your rights have changed")


class Connection(asyncio.Protocol):
    """One client, from its request to its end."""

    def __init__(self, server: WebSocketServer) -> None:
        self._server = server
        self._transport: asyncio.Transport | None = None
        self._host = self._name = ""  # the client's, the latter with its port
        self.identity = ""  # who it showed to be, where that is asked
        self._head = bytearray()
        self._early = b""  # what came behind a head that is being looked at
        self._reader: MessageReader | None = None
        self._channel: Channel | None = None
        self._unsubscribe: Callable[[], None] = lambda: None
        self._pending: set[asyncio.Future[None]] = set()
        self._patience = asyncio.get_running_loop().call_later(OPENING_SECONDS_MAX, self._give_up)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Somebody is there; nothing is promised yet."""
        self._transport = cast(asyncio.Transport, transport)
        peer = transport.get_extra_info("peername") or ("", 0)  # none: it is gone already
        self._host, self._name = peer[0], f"{peer[0]}:{peer[1]}"
        if len(self._server.connections) >= CONNECTIONS_MAX:
            self._transport.abort()
        else:
            self._server.connections.add(self)

    def data_received(self, data: bytes) -> None:
        """Bytes of the client."""
        try:
            if self._reader is None:
                self._head += data
                data = self._open()
            if self._reader is not None:
                for message in self._reader.feed(data):
                    self._take(message)
        except Broken as broken:
            self.leave(broken.code, str(broken))

    def connection_lost(self, exc: Exception | None) -> None:
        """It is gone; what it had asked for is finished nevertheless."""
        self._patience.cancel()
        self._transport = None
        self._server.connections.discard(self)
        self._unsubscribe()

    def send(self, text: str) -> None:
        """One text to the client; who does not read is cut off."""
        if self._transport is None or self._transport.is_closing():
            return
        if self._transport.get_write_buffer_size() > UNSENT_MAX:
            log.warning("a client of the frames' WebSocket does not read: cut off")
            self._transport.abort()
        else:
            self._transport.write(encode(Opcode.TEXT, text.encode("utf-8", "replace")))

    def leave(self, code: int, words: str = "") -> None:
        """Say goodbye and close."""
        if self._transport is not None:
            if self._reader is not None:
                self._transport.write(encode(Opcode.CLOSE, goodbye(code, words)))
            self._transport.close()

    def _open(self) -> bytes:
        """Answer the request once it is whole; what came behind it."""
        head, end, rest = bytes(self._head).partition(b"\r\n\r\n")
        if not end:
            if len(self._head) > OPENING_MAX:
                self._refuse("431 Request Header Fields Too Large", "the request is too long")
            return b""
        self._patience.cancel()
        opening = parse_opening(head)
        method, _, target = opening.line.partition(" ")
        path = target.partition(" ")[0].partition("?")[0]
        self._channel = self._server.channels.get(path)
        if self._channel is None:
            self._refuse("404 Not Found", f"there are {' and '.join(self._server.channels)}")
        elif method != "GET" or not opening.upgrades():
            self._refuse("426 Upgrade Required", "this is a WebSocket", "Upgrade: websocket\r\n")
        elif why := self._server.browsers.refusal(of_texts(opening.headers, method)):
            self._refuse("403 Forbidden", why)
        elif not self._server.admission.asks:
            self._accept(opening.key)
        else:
            self._early, rest = rest, b""
            self._enter(opening, path)
        return rest

    def _enter(self, opening: Opening, path: str) -> None:
        """Ask who it is; what is not known at once is looked at in the background."""
        shown = opening.headers.get("authorization", "")
        proof = Proof(ProofKind.HTTP, shown) if shown else NO_PROOF
        who = self._server.admission.known(self._name, proof)
        if who is not None:
            self._welcome(opening, path, who)
            return
        assert self._transport is not None
        self._transport.pause_reading()
        task = asyncio.ensure_future(self._look(opening, path, proof))
        self._pending.add(task)
        task.add_done_callback(self._answered)

    async def _look(self, opening: Opening, path: str, proof: Proof) -> None:
        try:
            who = await self._server.admission.admit(self._name, proof)
        except Unknown as unknown:
            self._refuse("401 Unauthorized", str(unknown), 'WWW-Authenticate: Basic realm="roboglot"\r\n')
        else:
            self._welcome(opening, path, who)

    def _welcome(self, opening: Opening, path: str, who: str) -> None:
        assert self._channel is not None
        self.identity = who
        try:
            copy_context().run(self._check, f"open {path}", self._channel.right)
        except Forbidden as forbidden:
            self._refuse("403 Forbidden", str(forbidden))
            return
        self._accept(opening.key)
        early, self._early = self._early, b""
        if early:
            self.data_received(early)

    def _check(self, operation: str, right: Right) -> None:
        """Raises Forbidden."""
        ask_for(f"visual {self.identity or self._host}", self._name, self.identity)
        self._server.admission.check("visual", operation, right)

    def _accept(self, key: str) -> None:
        assert self._transport is not None
        assert self._channel is not None
        answer = "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        self._transport.write(f"{answer}Sec-WebSocket-Accept: {accept_of(key)}\r\n\r\n".encode("latin-1"))
        try:
            self._unsubscribe = self._channel.subscribe(self.send)
        except RuntimeError as full:
            self.leave(1013, str(full))
        else:
            self._reader = MessageReader(masked=True)

    def _refuse(self, status: str, words: str, headers: str = "") -> None:
        if self._transport is not None:
            body = f"{words}\n".encode()
            head = f"HTTP/1.1 {status}\r\n{headers}Content-Length: {len(body)}\r\nConnection: close\r\n\r\n"
            self._transport.write(head.encode("latin-1") + body)
            self._transport.close()

    def _take(self, message: Message) -> None:
        match message.opcode:
            case Opcode.TEXT:
                self._answer(message.text)
            case Opcode.PING if self._transport is not None:
                self._transport.write(encode(Opcode.PONG, message.data))
            case Opcode.CLOSE:
                self.leave(1000)
            case Opcode.BINARY:
                raise Broken(1003, "frames are texts")

    def _answer(self, text: str) -> None:
        """In the background: an answer may take as long as a program takes to start."""
        assert self._channel is not None
        task = asyncio.ensure_future(self._receive(self._channel, text))
        self._pending.add(task)
        task.add_done_callback(self._answered)
        if len(self._pending) >= PENDING_MAX and self._transport is not None:
            self._transport.pause_reading()

    async def _receive(self, channel: Channel, text: str) -> None:
        ask_for(f"visual {self.identity or self._host}", self._name, self.identity)
        await channel.receive(text, self.send)

    def _answered(self, task: asyncio.Future[None]) -> None:
        self._pending.discard(task)
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("an answer over the WebSocket broke: %s", error, exc_info=error)
        if self._transport is not None and not self._transport.is_closing() and len(self._pending) < PENDING_MAX:
            self._transport.resume_reading()

    def _give_up(self) -> None:
        if self._transport is not None:
            self._transport.abort()


def log_line(task: str, entry: LogEntry) -> str:
    """One entry of a task's log, as ``/log`` tells it."""
    fields = {"target_id": task, "at": entry.at, "level": entry.level, "text": entry.text}
    return json.dumps(fields, ensure_ascii=False)
