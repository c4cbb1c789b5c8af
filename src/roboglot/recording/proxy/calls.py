"""Reads gRPC calls from a copy of one HTTP/2 connection's bytes. Knows no service, and answers nothing.

Header compression depends on all earlier headers of the connection, so each direction is read from its first byte on.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import field
from enum import IntEnum, IntFlag

from hpack import Decoder

from roboglot.values import dataclass

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"  # first bytes of a client
HEAD = 9  # bytes of a frame before its payload
FRAME_MAX = 1 << 24
MESSAGE_HEAD = 5  # bytes before a message: whether it is packed, and its length
MESSAGE_MAX = 16 << 20  # bytes, packed or not
CALLS_MAX = 1000  # that are open; further ones are not read
HEADER_TABLE_SIZE = 1  # the name of a setting
SETTING = 6  # bytes


class Http2Frame(IntEnum):
    """Kinds of frames that are read."""

    DATA = 0
    HEADERS = 1
    RST_STREAM = 3
    SETTINGS = 4
    CONTINUATION = 9


class Flag(IntFlag):
    """Flags of a frame."""

    END_STREAM = 1  # of data and headers
    ACK = 1  # of settings
    END_HEADERS = 4
    PADDED = 8
    PRIORITY = 32


@dataclass(slots=True)
class Call:
    """One call: its path, and the state of its reader."""

    path: str = ""
    code: str = ""
    at: float = 0.0
    ways: dict[str, _Messages] = field(default_factory=dict)
    status: int = 0  # of gRPC, with which it ended


@dataclass(slots=True)
class _Messages:
    """Messages of one direction of a call, as far as received."""

    packing: str = ""
    waiting: bytearray = field(default_factory=bytearray)


Heard = Callable[[Call, bytes], None]
Ended = Callable[[Call, int], None]
UNKNOWN, INTERNAL = 2, 13  # statuses of gRPC
RESETS = {7: 14, 8: 1, 11: 8, 12: 7}  # from HTTP/2's errors: unavailable, cancelled, exhausted, denied


class DirectionReader:
    """One direction of a connection: ``feed`` it; ``heard`` gets each whole message of a call.

    ``ended`` gets the status with which the called side ended a call. Raises ValueError, IndexError or hpack's
    HPACKError for bytes that are not HTTP/2.
    """

    def __init__(self, name: str, calls: dict[int, Call], heard: Heard, ended: Ended, preface: bytes = b"") -> None:
        self._name, self._calls, self._heard, self._ended = name, calls, heard, ended
        self._preface = preface
        self._rest = bytearray()
        self._decoder = Decoder()
        self._headers = bytearray()
        self._ends = False  # the call, with the headers that are not complete yet
        self.peer: DirectionReader | None = None

    def remember(self, size: int) -> None:
        """Set the size of the header table (bytes) that the other side allows for this side's headers."""
        self._decoder.max_allowed_table_size = size

    def feed(self, data: bytes) -> None:
        """Read received bytes."""
        rest = self._rest
        rest += data
        at = 0
        if self._preface:
            if len(rest) < len(self._preface):
                return
            if not rest.startswith(self._preface):
                raise ValueError("no HTTP/2")
            at, self._preface = len(self._preface), b""
        while len(rest) - at >= HEAD:
            size = int.from_bytes(rest[at : at + 3])
            end = at + HEAD + size
            if len(rest) < end:
                break
            kind, flags, stream = rest[at + 3], rest[at + 4], int.from_bytes(rest[at + 5 : at + HEAD]) & 0x7FFFFFFF
            self._frame(kind, Flag(flags), stream, bytes(rest[at + HEAD : end]))
            at = end
        del rest[:at]

    def _frame(self, kind: int, flags: Flag, stream: int, payload: bytes) -> None:
        match kind:
            case Http2Frame.DATA:
                if call := self._calls.get(stream):
                    self._data(call, _unpadded(flags, payload))
                self._end_with(flags, stream)
            case Http2Frame.HEADERS:
                payload = _unpadded(flags, payload)
                self._headers = bytearray(payload[5:] if flags & Flag.PRIORITY else payload)
                self._ends = bool(flags & Flag.END_STREAM)
                self._head(flags, stream)
            case Http2Frame.CONTINUATION:
                self._headers += payload
                if len(self._headers) > FRAME_MAX:
                    raise ValueError("headers without an end")
                self._head(flags, stream)
            case Http2Frame.RST_STREAM:
                self._end(stream, RESETS.get(int.from_bytes(payload[:4]), INTERNAL))
            case Http2Frame.SETTINGS if not flags & Flag.ACK:
                self._settings(payload)

    def _head(self, flags: Flag, stream: int) -> None:
        """Decode headers, of every call, as later ones refer to them."""
        if not flags & Flag.END_HEADERS:
            return
        found = {_text(name): _text(value) for name, value in self._decoder.decode(bytes(self._headers), raw=True)}
        self._headers = bytearray()
        call = self._calls.get(stream)
        if call is None and ":path" in found and len(self._calls) < CALLS_MAX:
            call = self._calls[stream] = Call(found[":path"])
        if call is not None and "grpc-encoding" in found:
            call.ways.setdefault(self._name, _Messages()).packing = found["grpc-encoding"]
        if call is not None and (status := found.get("grpc-status", "0")) != "0" and self._name == "answers":
            call.status = int(status) if status.isascii() and status.isdigit() else UNKNOWN
        if self._ends:
            self._end_with(Flag.END_STREAM, stream)

    def _end_with(self, flags: Flag, stream: int) -> None:
        """Forget a call when the side that answers ends it."""
        if flags & Flag.END_STREAM and self._name == "answers":
            self._end(stream, 0)

    def _end(self, stream: int, status: int) -> None:
        call = self._calls.pop(stream, None)
        if call is not None and self._name == "answers":  # a caller that goes has no answer
            self._ended(call, call.status or status)

    def _data(self, call: Call, data: bytes) -> None:
        way = call.ways.setdefault(self._name, _Messages())
        way.waiting += data
        while len(way.waiting) >= MESSAGE_HEAD:
            size = int.from_bytes(way.waiting[1:MESSAGE_HEAD])
            if size > MESSAGE_MAX:
                raise ValueError(f"a message of {size} bytes")
            if len(way.waiting) < MESSAGE_HEAD + size:
                return
            message = bytes(way.waiting[MESSAGE_HEAD : MESSAGE_HEAD + size])
            packed = way.waiting[0] & 1
            del way.waiting[: MESSAGE_HEAD + size]
            self._heard(call, unpacked(way.packing, message) if packed else message)

    def _settings(self, payload: bytes) -> None:
        """Apply settings: this side's header table size limits the other side's compression."""
        for at in range(0, len(payload) - SETTING + 1, SETTING):
            if int.from_bytes(payload[at : at + 2]) == HEADER_TABLE_SIZE and self.peer is not None:
                self.peer.remember(int.from_bytes(payload[at + 2 : at + SETTING]))


def both(asked: Heard, answered: Heard, ended: Ended) -> tuple[DirectionReader, DirectionReader]:
    """Return the two directions of a connection: the caller's, which begins with the preface, and the answerer's."""
    calls: dict[int, Call] = {}
    asking, answering = (
        DirectionReader("asks", calls, asked, ended, PREFACE),
        DirectionReader("answers", calls, answered, ended),
    )
    asking.peer, answering.peer = answering, asking
    return asking, answering


def _unpadded(flags: Flag, payload: bytes) -> bytes:
    return payload[1 : len(payload) - payload[0]] if flags & Flag.PADDED else payload


def unpacked(packing: str, message: bytes) -> bytes:
    """Return a message decompressed; unchanged if the compression is unknown. Raises ValueError."""
    if packing not in ("gzip", "deflate"):
        return message
    unpacking = zlib.decompressobj(zlib.MAX_WBITS | 32)  # of either form
    try:
        return unpacking.decompress(message, MESSAGE_MAX)
    except zlib.error as error:
        raise ValueError(f"a packed message: {error}") from None


def _text(value: str | bytes) -> str:
    return value if isinstance(value, str) else value.decode("latin-1")
