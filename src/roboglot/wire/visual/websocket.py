"""WebSocket (RFC 6455) for both ends, as far as texts need it: the opening, and frames to messages and back.

Knows no socket. Extensions and sub-protocols are not offered; everything from outside is bounded.
"""

from __future__ import annotations

import base64
import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

OPENING_MAX = 8192  # bytes of a request or an answer before the first frame
MESSAGE_MAX = 8 * 1024 * 1024  # bytes
_SMALL_MAX = 125  # bytes of a control frame
_GUID = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"


class Opcode(IntEnum):
    """Opcode of a frame."""

    CONTINUATION = 0
    TEXT = 1
    BINARY = 2
    CLOSE = 8
    PING = 9
    PONG = 10


class Broken(ValueError):
    """The other end does not keep to the rules; ``code`` is what to close with."""

    def __init__(self, code: int, words: str) -> None:
        super().__init__(words)
        self.code = code


@dataclass(frozen=True, slots=True)
class Message:
    """A whole text or a control frame."""

    opcode: Opcode
    data: bytes

    @property
    def text(self) -> str:
        """Raises Broken for what is no UTF-8."""
        try:
            return self.data.decode()
        except UnicodeDecodeError:
            raise Broken(1007, "not UTF-8") from None


@dataclass(frozen=True, slots=True)
class Opening:
    """The first line of a request or an answer, and its headers in lower case."""

    line: str
    headers: dict[str, str]

    def upgrades(self) -> bool:
        """True if it asks for a WebSocket of the one version there is."""
        connection = {word.strip().lower() for word in self.headers.get("connection", "").split(",")}
        asked = self.headers.get("upgrade", "").lower() == "websocket" and "upgrade" in connection
        return asked and self.headers.get("sec-websocket-version") == "13" and bool(self.key)

    @property
    def key(self) -> str:
        """Headers of the client's request."""
        return self.headers.get("sec-websocket-key", "")


def parse_opening(head: bytes) -> Opening:
    """Read all lines before the empty one. Raises Broken."""
    line, *rows = head.decode("latin-1").split("\r\n")
    headers: dict[str, str] = {}
    for row in rows:
        name, colon, value = row.partition(":")
        if not colon or not name or name != name.strip():
            raise Broken(1002, "a header without a name")
        headers[name.lower()] = value.strip()
    return Opening(line, headers)


def request_opening(host: str, path: str, key: str) -> bytes:
    """A client's request."""
    rows = (
        f"GET {path} HTTP/1.1",
        f"Host: {host}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {key}",
        "Sec-WebSocket-Version: 13",
    )
    return ("\r\n".join(rows) + "\r\n\r\n").encode()


def new_key() -> str:
    """A client's key."""
    return base64.b64encode(os.urandom(16)).decode()


def accept_of(key: str) -> str:
    """Return the server's answer to ``key``."""
    return base64.b64encode(hashlib.sha1(key.encode("latin-1") + _GUID).digest()).decode()


def encode(opcode: Opcode, data: bytes, *, masked: bool = False) -> bytes:
    """One frame that is a whole message; clients mask theirs."""
    size, mark = len(data), 0x80 if masked else 0
    if size <= _SMALL_MAX:
        head = bytes((0x80 | opcode, mark | size))
    elif size < 1 << 16:
        head = bytes((0x80 | opcode, mark | 126)) + size.to_bytes(2, "big")
    else:
        head = bytes((0x80 | opcode, mark | 127)) + size.to_bytes(8, "big")
    if not masked:
        return head + data
    mask = os.urandom(4)
    return head + mask + _masked(data, mask)


def goodbye(code: int, words: str = "") -> bytes:
    """The contents of a close frame."""
    return code.to_bytes(2, "big") + words.encode()[: _SMALL_MAX - 2].decode("utf-8", "ignore").encode()


class MessageReader:
    """Bytes to messages; ``masked``: whether the other end has to mask its frames (clients have to).

    ``limit``: bytes of a message.
    """

    def __init__(self, *, masked: bool, limit: int = MESSAGE_MAX) -> None:
        self._must_mask = masked
        self._limit = limit
        self._bytes = bytearray()
        self._pieces = bytearray()
        self._unfinished: Opcode | None = None

    def feed(self, data: bytes) -> Iterator[Message]:
        """Return the frames that ``data`` completes. Raises Broken."""
        self._bytes += data
        while (frame := self._frame()) is not None:
            opcode, last, payload = frame
            if opcode >= Opcode.CLOSE:
                yield Message(opcode, payload)
                continue
            if (opcode is Opcode.CONTINUATION) is (self._unfinished is None):
                raise Broken(1002, "pieces of messages out of order")
            self._pieces += payload
            if len(self._pieces) > self._limit:
                raise Broken(1009, f"a message has at most {self._limit} bytes")
            self._unfinished = self._unfinished or opcode
            if last:
                message = Message(self._unfinished, bytes(self._pieces))
                self._pieces, self._unfinished = bytearray(), None
                yield message

    def _frame(self) -> tuple[Opcode, bool, bytes] | None:
        buffer = self._bytes
        if len(buffer) < 2:
            return None
        first, second = buffer[0], buffer[1]
        try:
            opcode = Opcode(first & 0x0F)
        except ValueError:
            raise Broken(1002, "a frame of no known kind") from None
        last, masked, size, head = bool(first & 0x80), bool(second & 0x80), second & 0x7F, 2
        if first & 0x70 or masked is not self._must_mask:
            raise Broken(1002, "reserved bits, or a mask where none belongs")
        if opcode >= Opcode.CLOSE and (size > _SMALL_MAX or not last):
            raise Broken(1002, "a control frame that is long or in pieces")
        if size > _SMALL_MAX:
            head += 2 if size == 126 else 8
            if len(buffer) < head:
                return None
            size = int.from_bytes(buffer[2:head], "big")
        if size > self._limit:
            raise Broken(1009, f"a message has at most {self._limit} bytes")
        start = head + (4 if masked else 0)
        if len(buffer) < start + size:
            return None
        payload = bytes(buffer[start : start + size])
        if masked:
            payload = _masked(payload, bytes(buffer[head:start]))
        del buffer[: start + size]
        return opcode, last, payload


def _masked(data: bytes, mask: bytes) -> bytes:
    repeated = mask * (len(data) // 4 + 1)
    return (int.from_bytes(data, "little") ^ int.from_bytes(repeated[: len(data)], "little")).to_bytes(
        len(data), "little"
    )
