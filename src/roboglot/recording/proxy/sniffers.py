"""Parsers of the traffic between a client and a robot, a class for each protocol. They get copies only."""

from __future__ import annotations

import json
import re
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import httptools

from roboglot.model.tap import PAYLOAD_MAX, Direction
from roboglot.recording.lines import FRAMES, LOG, status_of
from roboglot.recording.proxy.calls import unpacked
from roboglot.wire.contracts import contract
from roboglot.wire.robomaster.commands import Malformed, parse
from roboglot.wire.robomaster.lines import LineSplitter
from roboglot.wire.visual.requests import BadFrame, FrameSubject, parse_request

if TYPE_CHECKING:
    from wsproto.connection import Connection

BEYOND = {"version", "version ?"}  # commands that robots know although the manual does not list them
WAITING_MAX = 1000  # requests awaiting an answer
PATH_MAX = 128  # bytes of a request's first line
HEAD_MAX = 1 << 16  # bytes of a handshake
EXTENSION = re.compile(rb"^sec-websocket-extensions:\s*(permessage-deflate[^,\r]*)", re.IGNORECASE | re.MULTILINE)
PIECE = 1 << 14  # bytes of frames read at once
Note = Callable[[Direction, str, bytes, str, float | None], float]


class Sniffer(ABC):
    """One connection. ``note`` takes direction, operation, payload, status, time of the request; returns the time."""

    def __init__(self, note: Note) -> None:
        self._note = note
        self._waiting: deque[tuple[str, float]] = deque(maxlen=WAITING_MAX)

    @abstractmethod
    def from_client(self, data: bytes) -> None:
        """Parse bytes to the robot. An error ends the parsing of this connection, not the connection itself."""

    @abstractmethod
    def from_robot(self, data: bytes) -> None:
        """Parse bytes to the client."""

    def _on_request(self, operation: str, payload: bytes) -> None:
        self._waiting.append((operation, self._note(Direction.REQUEST, operation, payload[:PAYLOAD_MAX], "", None)))

    def _answered(self, payload: bytes, status: str) -> None:
        operation, began = self._waiting.popleft() if self._waiting else ("", None)
        self._note(Direction.REPLY, operation, payload[:PAYLOAD_MAX], status, began)


class TextSniffer(Sniffer):
    """The EP's control port: answers come in the order of the commands, each ended by ``;``."""

    def __init__(self, note: Note) -> None:
        super().__init__(note)
        self._commands, self._rest = LineSplitter(), b""
        self._keys = BEYOND | {row.key for row in contract("robomaster")}

    def from_client(self, data: bytes) -> None:
        for text in self._commands.feed(data):
            if text is not None:
                self._on_request(self._key(text), text.encode())

    def from_robot(self, data: bytes) -> None:
        *whole, self._rest = (self._rest + data).split(b";")
        if len(self._rest) > PAYLOAD_MAX:
            raise ValueError("no end in sight")
        for part in whole:
            self._answered(part + b";", status_of("robomaster", part + b";"))

    def _key(self, text: str) -> str:
        try:
            return next((key for key, _ in parse(text).keys if key in self._keys), "")
        except Malformed:
            return ""


class _Message:
    """Contents of one HTTP message, collected by httptools."""

    def __init__(self, done: Callable[[], None]) -> None:
        self._done = done
        self.on_message_begin()

    def on_message_begin(self) -> None:
        self.target, self.packing, self.has_size, self.has_head = b"", "", False, False
        self.body = bytearray()

    def on_url(self, url: bytes) -> None:
        self.target += url

    def on_header(self, name: bytes, value: bytes) -> None:
        match name.lower():
            case b"content-encoding":
                self.packing = value.decode("latin-1").strip().lower()
            case b"content-length" | b"transfer-encoding":
                self.has_size = True

    def on_headers_complete(self) -> None:
        self.has_head = True

    def on_body(self, body: bytes) -> None:
        if len(self.body) < PAYLOAD_MAX:
            self.body += body

    def on_message_complete(self) -> None:
        self._done()

    @property
    def payload(self) -> bytes:
        """The decompressed body, since compressed data cannot be redacted."""
        return unpacked(self.packing, bytes(self.body))


class RestSniffer(Sniffer):
    """Slamware: HTTP/1.1 with kept connections."""

    def __init__(self, note: Note) -> None:
        super().__init__(note)
        self._asking, self._answering = _Message(self._request), _Message(self._reply)
        self._requests: Any = httptools.HttpRequestParser(self._asking)
        self._replies: Any = httptools.HttpResponseParser(self._answering)
        self._methods: deque[str] = deque(maxlen=WAITING_MAX)

    def from_client(self, data: bytes) -> None:
        self._requests.feed_data(data)

    def from_robot(self, data: bytes) -> None:
        message = self._answering
        if data:
            self._replies.feed_data(data)
            ends = message.has_head and next(iter(self._methods), "") == "HEAD"  # the size in its head is another's
        else:
            ends = message.has_head and not message.has_size  # the end of the connection ends it
        if ends:
            self._reply()
            self._replies = httptools.HttpResponseParser(message)

    def _request(self) -> None:
        method, message = self._requests.get_method().decode(), self._asking
        path = message.target.decode("latin-1")
        self._methods.append(method)
        self._on_request(rest_operation(method, path), f"{method} {path}\n\n".encode("latin-1") + message.payload)

    def _reply(self) -> None:
        message, status = self._answering, self._replies.get_status_code()
        if status >= 200:  # others only announce an answer
            if self._methods:
                self._methods.popleft()
            self._answered(message.payload, str(status))
        message.on_message_begin()


@cache
def _paths() -> list[tuple[str, tuple[str, ...], str]]:
    found = []
    for row in contract("slamware"):
        method, _, path = row.key.partition(" ")
        found.append((method, tuple(path.split("/")), row.key))
    return sorted(found, key=lambda entry: sum(part.startswith("{") for part in entry[1]))


def rest_operation(method: str, path: str) -> str:
    """Return the contract's key of a request; empty if the contract has none."""
    parts = path.partition("?")[0].rstrip("/").split("/")
    for known, segments, key in _paths():
        if known == method and len(segments) == len(parts) and _fits(segments, parts):
            return key
    return ""


def _fits(segments: tuple[str, ...], parts: list[str]) -> bool:
    return all(mine.startswith("{") or mine == theirs for mine, theirs in zip(segments, parts, strict=True))


class FrameSniffer(Sniffer):
    """Block programs over a WebSocket: answers carry the id of their request, other frames are pushes.

    On other paths than the frames' (``/log``), the path is the operation.
    """

    def __init__(self, note: Note) -> None:
        super().__init__(note)
        self._ends: dict[bool, Connection] = {}  # by whether the client sends; filled when the robot has agreed
        self._began: dict[str, tuple[str, float]] = {}
        self._partial = {True: "", False: ""}
        self._early = {True: b"", False: b""}  # bytes before that
        self._path = FRAMES
        self._path_asked = 0.0  # the time of that request

    def from_client(self, data: bytes) -> None:
        self._feed(data, client=True)

    def from_robot(self, data: bytes) -> None:
        self._feed(data, client=False)

    def _feed(self, data: bytes, *, client: bool) -> None:
        if self._ends:
            self._frames(data, client=client)
            return
        self._early[client] += data
        (asked, _, sent), (agreed, end, came) = (self._early[one].partition(b"\r\n\r\n") for one in (True, False))
        if max(len(asked), len(agreed)) > HEAD_MAX or len(sent) > PAYLOAD_MAX:
            raise ValueError("no end of a handshake in sight")
        if end:
            self._path = (
                asked[:PATH_MAX].partition(b" ")[2].partition(b" ")[0].partition(b"?")[0].decode("ascii", "replace")
            )
            self._agree(agreed)
            self._early.clear()
            self._frames(sent, client=True)
            self._frames(came, client=False)

    def _agree(self, head: bytes) -> None:
        """Read frames from now on, compressed ones if the robot's answer accepts that."""
        from wsproto.connection import Connection, ConnectionType
        from wsproto.extensions import Extension, PerMessageDeflate

        packing = EXTENSION.search(head)
        for client, kind in ((True, ConnectionType.SERVER), (False, ConnectionType.CLIENT)):  # as the receiver would
            unpacking = list[Extension]()
            if packing:
                unpacking.append(PerMessageDeflate())
                unpacking[0].finalize(packing[1].decode("latin-1"))
            self._ends[client] = Connection(kind, unpacking)

    def _frames(self, data: bytes, *, client: bool) -> None:
        from wsproto.events import TextMessage

        for at in range(0, len(data), PIECE):  # that unpacks to little at once
            self._ends[client].receive_data(data[at : at + PIECE])
            for event in self._ends[client].events():
                if isinstance(event, TextMessage):
                    self._partial[client] += event.data
                    if len(self._partial[client]) > PAYLOAD_MAX:
                        raise ValueError("no end of a message in sight")
                    if event.message_finished:
                        text, self._partial[client] = self._partial[client], ""
                        (self._frame_asked if client else self._frame_came)(text)

    def _frame_asked(self, text: str) -> None:
        if self._path != FRAMES:
            self._path_asked = self._note(Direction.REQUEST, self._path, text.encode(), "", None)
            return
        try:
            request = parse_request(text)
            mode = request.operate if request.kind in (FrameSubject.TASK, FrameSubject.MODULE) else request.mode
            key, id = f"{request.kind} {mode}", request.id
        except BadFrame as bad:
            key, id = "", bad.id
        now = self._note(Direction.REQUEST, key, text.encode(), "", None)
        if len(self._began) < WAITING_MAX:
            self._began[id] = key, now

    def _frame_came(self, text: str) -> None:
        if self._path != FRAMES:
            if self._path == LOG and '"entries"' not in text:
                self._note(Direction.PUSH, LOG, text.encode(), "", None)
            else:
                self._note(Direction.REPLY, self._path, text.encode(), "ok", self._path_asked)
            return
        frame = json.loads(text)
        inner = frame.get("feedback") or frame.get("response") or {}
        asked = self._began.get(inner.get("id", ""))
        if asked:
            self._note(Direction.REPLY, asked[0], text.encode(), status_of("visual", text.encode()), asked[1])
        else:
            self._note(Direction.PUSH, "robot block" if "block" in frame else "robot feedback", text.encode(), "", None)


SNIFFERS: dict[str, type[Sniffer]] = {"slamware": RestSniffer, "robomaster": TextSniffer, "visual": FrameSniffer}
