"""Connections to robots that send recorded requests unchanged; a class for each protocol."""

from __future__ import annotations

import asyncio
import json
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from roboglot.clients.errors import ClientError, LinkLost
from roboglot.hosting.error_text import in_words
from roboglot.model.clock import Clock
from roboglot.recording.redaction import FILES
from roboglot.wire.cyberdog.text import code_of
from roboglot.wire.foxglove.messages import SUBPROTOCOLS, ClientOpcode
from roboglot.wire.robomaster.replies import Reply

if TYPE_CHECKING:
    from websockets.asyncio.client import ClientConnection

PATIENCE = 60.0  # s for an answer
LINE_MAX = 1 << 20
FRAMES, LOG = "/programs", "/log"  # paths of a WebSocket
PORTS = {"slamware": 1448, "robomaster": 40923, "cyberdog": 50052, "visual": 50053}
SHOWN = re.compile(r'"op":"(?:advertise|status)"')  # the Foxglove door has advertised its topics, or reports why not
BINARY = tuple(bytes([opcode]) for opcode in ClientOpcode)  # first bytes of Foxglove's binary messages
REFUSALS = tuple(str(reply) for reply in Reply if reply is not Reply.OK)
Answers = list[tuple[bytes, str]]
Pushed = Callable[[str, bytes], None]


def status_of(door: str, payload: bytes) -> str:
    """Return an answer's status in the tap's words; REST has it beside the payload."""
    text = payload.decode("utf-8", "replace")
    if door == "robomaster":
        return text.rstrip(" ;\r\n") if text.startswith(REFUSALS) else "ok"
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return "ok"
    value = value if isinstance(value, dict) else {}
    if door == "visual":
        feedback = value.get("feedback")
        state = feedback.get("state", 0) if isinstance(feedback, dict) else 0
        return f"state {state}" if state else "ok"
    return f"error_code {value['error_code']}" if value.get("error_code") else "ok"


class Line(ABC):
    """``open`` and ``close`` it; ``request`` sends one request and returns the answers. Raises ClientError.

    ``comes``: the robot notices the opening. ``own``: local address of this machine; empty: any.
    """

    comes, own = True, ""

    def __init__(self, host: str, port: int, clock: Clock, pushed: Pushed) -> None:
        self.host, self.port, self.clock, self.pushed = host, port, clock, pushed

    @abstractmethod
    async def open(self) -> None:
        """Connect."""

    @abstractmethod
    async def request(self, operation: str, payload: bytes, answers: Sequence[bytes]) -> Answers:
        """Send one request; ``answers``: the recorded ones, for the number and kind to expect."""

    @abstractmethod
    async def close(self) -> None:
        """Hang up."""


class RestLine(Line):
    """Slamware's REST API."""

    async def open(self) -> None:
        from roboglot.clients.slamware.http import HttpLink

        self._link = HttpLink(self.host, self.port, self.clock)

    async def request(self, operation: str, payload: bytes, answers: Sequence[bytes]) -> Answers:  # noqa: ARG002
        head, _, body = payload.partition(b"\n\n")
        method, _, path = head.decode("latin-1").partition(" ")
        kind = "application/json" if body[:1] in (b"{", b"[", b"") else "application/octet-stream"
        answer = await self._link.ask(method, path, body, kind, PATIENCE)
        return [(bytes(answer.body), str(answer.status))]

    async def close(self) -> None:
        self._link.close()


class TextLine(Line):
    """RoboMaster's control port. Pushes come by UDP and are not listened to."""

    async def open(self) -> None:
        try:
            local = (self.own, 0) if self.own else None
            connecting = asyncio.open_connection(self.host, self.port, limit=LINE_MAX, local_addr=local)
            self._reader, self._writer = await self.clock.wait_for(connecting, PATIENCE)
        except (OSError, TimeoutError) as error:
            raise LinkLost(f"{self.host}:{self.port} cannot be reached: {in_words(error)}") from None

    async def request(self, operation: str, payload: bytes, answers: Sequence[bytes]) -> Answers:  # noqa: ARG002
        self._writer.write(payload.rstrip(b" ;") + b";")
        if not answers:
            return []
        try:
            reply = await self.clock.wait_for(self._reader.readuntil(b";"), PATIENCE)
        except (OSError, EOFError, TimeoutError, asyncio.LimitOverrunError) as error:
            raise LinkLost(f"no answer to {payload[:60]!r}: {in_words(error)}") from None
        return [(reply, status_of("robomaster", reply))]

    async def drain(self) -> None:
        """Read and discard data until the robot hangs up."""
        while await self._reader.read(LINE_MAX):
            pass

    async def close(self) -> None:
        self._writer.close()


class DogLine(Line):
    """CyberDog's gRPC; ``options``: certs and app of the URL."""

    options: dict[str, str]

    async def open(self) -> None:
        from roboglot.clients.cyberdog.link import Certificates, DogLink

        folder = self.options.get("certs", "none")
        try:
            certificates = None if folder == "none" else Certificates.load(Path(folder))
        except OSError as error:
            raise LinkLost(f"the certificates in {folder} cannot be read: {error.strerror}") from None
        self._link = DogLink(
            self.host,
            self.port,
            certificates,
            self.clock,
            app_port=int(self.options["app"]) if "app" in self.options else None,
            pushed=lambda code, text: self.pushed(str(code), text.encode()),
        )
        await self._link.open()

    async def request(self, operation: str, payload: bytes, answers: Sequence[bytes]) -> Answers:
        found: Answers = []
        if (code := code_of(operation)) is None:
            return found
        text = payload.decode("utf-8", "replace")
        if operation in FILES and answers and answers[0][:1] != b"{":  # recorded in chunks
            async for chunk in self._link.fetch(code, text):
                found.append((chunk.SerializeToString(), "ok"))
            return found
        async for _, answer in self._link.send(code, text):
            found.append((answer.encode(), status_of("cyberdog", answer.encode())))
        return found

    async def close(self) -> None:
        await self._link.close()


class FrameLine(Line):
    """Block programs over their WebSocket: answers carry the id of their request, other frames are pushes.

    An operation that is a path (``/log``) has a socket of its own; ``path`` is that of the first socket.
    """

    path = FRAMES

    async def open(self) -> None:
        self._sockets: dict[str, ClientConnection] = {}
        self._draining: list[asyncio.Task[None]] | None = None
        await self._socket(self.path)

    async def request(self, operation: str, payload: bytes, answers: Sequence[bytes]) -> Answers:
        path = operation if operation.startswith("/") else FRAMES
        socket = await self._socket(path)
        await socket.send(payload.decode("utf-8", "replace"))
        wanted, found = _frame_id(payload) or "", Answers()  # a frame without id is answered with an empty one
        while len(found) < len(answers):
            frame = await self._next(socket, operation)
            if path != FRAMES or _frame_id(frame) == wanted:
                found.append((frame, status_of("visual", frame)))
                if b'"entries"' in frame and path == LOG:  # the last frame of that log
                    break
            else:
                self.pushed("robot block" if b'"block"' in frame else "robot feedback", frame)
        return found

    async def _socket(self, path: str) -> ClientConnection:
        from websockets.asyncio.client import connect
        from websockets.exceptions import WebSocketException

        if path not in self._sockets:
            try:
                address = f"ws://{self.host}:{self.port}{path}"
                socket = await self.clock.wait_for(connect(address, max_size=LINE_MAX), PATIENCE)
            except (OSError, TimeoutError, WebSocketException) as error:
                raise LinkLost(f"{address} cannot be reached: {in_words(error)}") from None
            self._sockets[path] = socket
            if self._draining is not None:
                self._draining.append(asyncio.ensure_future(_drain(socket)))
        return self._sockets[path]

    async def _next(self, socket: ClientConnection, operation: str) -> bytes:
        from websockets.exceptions import ConnectionClosed

        try:
            message = await self.clock.wait_for(socket.recv(), PATIENCE)
        except (TimeoutError, ConnectionClosed) as error:
            raise LinkLost(f"no answer to {operation}: {error}") from None
        return message.encode() if isinstance(message, str) else bytes(message)

    async def drain(self) -> None:
        """Read and discard data until the robot hangs up."""
        self._draining = []
        await _drain(self._sockets[self.path])

    async def close(self) -> None:
        for task in self._draining or ():
            task.cancel()
        for socket in self._sockets.values():
            await socket.close()


async def _drain(socket: ClientConnection) -> None:
    async for _ in socket:
        pass


def _frame_id(frame: bytes) -> object:
    try:
        value = json.loads(frame)
    except (ValueError, RecursionError):
        return None
    if not isinstance(value, dict):
        return None
    inner = value.get("feedback") or value.get("response") or value
    return inner.get("id") if isinstance(inner, dict) else None


class FoxgloveLine(Line):
    """Foxglove's WebSocket, for a rerun: no answer is waited for."""

    async def open(self) -> None:
        """Connect, and wait until the robot has shown its topics, as Foxglove does."""
        from websockets.asyncio.client import connect
        from websockets.exceptions import WebSocketException
        from websockets.typing import Subprotocol

        address = f"ws://{self.host}:{self.port}/"
        known = [Subprotocol(name) for name in SUBPROTOCOLS]
        try:
            connecting = connect(address, max_size=LINE_MAX, subprotocols=known)
            self._socket = await self.clock.wait_for(connecting, PATIENCE)
            while not SHOWN.search(await self._text()):
                pass
        except (OSError, TimeoutError, WebSocketException) as error:
            raise LinkLost(f"{address} cannot be reached: {in_words(error)}") from None

    async def _text(self) -> str:
        message = await self.clock.wait_for(self._socket.recv(), PATIENCE)
        return message if isinstance(message, str) else ""

    async def request(self, operation: str, payload: bytes, answers: Sequence[bytes]) -> Answers:  # noqa: ARG002
        from websockets.exceptions import WebSocketException

        binary = payload[:1] in BINARY
        try:
            await self._socket.send(payload if binary else payload.decode("utf-8", "replace"))
        except WebSocketException as error:
            raise LinkLost(f"{operation} cannot be sent: {error}") from None
        return []

    async def drain(self) -> None:
        """Read and discard data until the robot hangs up."""
        await _drain(self._socket)

    async def close(self) -> None:
        await self._socket.close()


LINES: dict[str, type[Line]] = {"slamware": RestLine, "robomaster": TextLine, "cyberdog": DogLine, "visual": FrameLine}


class Target:
    """A robot's URL: ``slamware://HOST[:PORT]``, ``robomaster://…``, ``visual://…``, ``cyberdog://HOST?certs=FOLDER``."""

    def __init__(self, url: str) -> None:
        """Raises ValueError in plain words."""
        try:
            parts = urlsplit(url)
            self.host, self.port = parts.hostname or "", parts.port or PORTS.get(parts.scheme, 0)
            self.options = dict(parse_qsl(parts.query, strict_parsing=bool(parts.query), max_num_fields=8))
        except ValueError as error:
            raise ValueError(f"{url}: {error}") from None
        if parts.scheme not in LINES or not self.host:
            raise ValueError(f"a robot's URL is one of {', '.join(f'{s}://HOST' for s in LINES)}, not {url}")
        self.door = parts.scheme

    def line(self, clock: Clock, pushed: Pushed) -> Line:
        """Return a connection that is not open yet."""
        line = LINES[self.door](self.host, self.port, clock, pushed)
        if isinstance(line, DogLine):
            line.options = self.options
        return line


__all__ = ["ClientError", "Line", "Target", "status_of"]
