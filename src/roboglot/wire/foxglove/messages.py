"""Messages of the protocol: JSON objects with ``op``, and binary ones with a number in their first byte.

The subprotocols ``foxglove.sdk.v1`` and ``foxglove.websocket.v1`` have the same messages; the first also has playback.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from enum import IntEnum
from typing import Any

import msgspec

from roboglot.validation import decode_json, why_invalid
from roboglot.values import dataclass

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
PLAYS = SUBPROTOCOLS[:1]  # the subprotocols with playback
ENCODING_MAX = 64  # bytes of the name of an encoding
REQUEST_ID_MAX = 256  # bytes of the id of a playback request
_DATA = struct.Struct("<BIQ")
_TIME = struct.Struct("<BQ")
_PUBLISHED = struct.Struct("<BI")
PUBLISHED_SIZE = _PUBLISHED.size  # bytes before what a client publishes
_CALL = struct.Struct("<BIII")
_PLAYBACK = struct.Struct("<BBfBQI")
_STATE = struct.Struct("<BBQf?I")
_ASSET = struct.Struct("<BIBI")


class Level(IntEnum):
    """Severity of a status."""

    INFO = 0
    WARNING = 1
    ERROR = 2


class ServerOpcode(IntEnum):
    """First byte of the server's binary messages."""

    MESSAGE_DATA = 1
    TIME = 2
    SERVICE_CALL_RESPONSE = 3
    FETCH_ASSET_RESPONSE = 4
    PLAYBACK_STATE = 5


class ClientOpcode(IntEnum):
    """First byte of a client's binary messages."""

    MESSAGE_DATA = 1
    SERVICE_CALL_REQUEST = 2
    PLAYBACK_CONTROL_REQUEST = 3


class PlayStatus(IntEnum):
    """State of a player."""

    PLAYING = 0
    PAUSED = 1
    BUFFERING = 2
    ENDED = 3


class Malformed(ValueError):
    """A message does not conform to the protocol; the text says why."""


@dataclass(frozen=True, slots=True)
class Request:
    """Request of a client: the contract's key and the fields."""

    key: str
    values: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Playback:
    """State of a player: ``time`` in ns since 1970, id of the answered ``request``, and ``sought`` after a seek."""

    status: int
    time: int
    speed: float
    sought: bool = False
    request: str = ""


def read_request(message: str | bytes) -> Request:
    """Parse a message of a client. Raises Malformed."""
    return _read_text(message) if isinstance(message, str) else _read_bytes(message)


def _read_text(text: str) -> Request:
    try:
        value = decode_json(text, dict[str, Any])
    except msgspec.DecodeError as error:
        raise Malformed(f"a message is a JSON object: {why_invalid(error)}") from None
    if not isinstance(value.get("op"), str):
        raise Malformed("a message is a JSON object with op")
    return Request(value.pop("op"), value)


def _read_bytes(data: bytes) -> Request:
    try:
        opcode = ClientOpcode(data[0])
    except (IndexError, ValueError):
        raise Malformed(f"no binary message of a client begins with {data[:1].hex() or 'nothing'}") from None
    try:
        match opcode:
            case ClientOpcode.MESSAGE_DATA:
                _, channel = _PUBLISHED.unpack_from(data)
                return Request("messageData", {"channel": channel, "data": data[PUBLISHED_SIZE:]})
            case ClientOpcode.SERVICE_CALL_REQUEST:
                return _read_call(data)
            case ClientOpcode.PLAYBACK_CONTROL_REQUEST:
                return _read_playback(data)
    except struct.error:
        raise Malformed(f"{opcode.name.lower()} is cut off") from None


def _read_call(data: bytes) -> Request:
    _, service, call, length = _CALL.unpack_from(data)
    encoding, end = _text(data, _CALL.size, length, ENCODING_MAX)
    values = {"service": service, "call": call, "encoding": encoding, "data": data[end:]}
    return Request("serviceCallRequest", values)


def _read_playback(data: bytes) -> Request:
    """Return a playback request; ``seek``: ns since 1970 or None. Early versions have no request id."""
    padded = data if len(data) >= _PLAYBACK.size else data + bytes(4)
    _, command, speed, sought, seek, length = _PLAYBACK.unpack_from(padded)
    request, _ = _text(padded, _PLAYBACK.size, length, REQUEST_ID_MAX)
    values = {"command": command, "speed": speed, "seek": seek if sought else None, "request": request}
    return Request("playbackControlRequest", values)


def _text(data: bytes, start: int, length: int, most: int) -> tuple[str, int]:
    end = start + length
    if length > most or end > len(data):
        raise Malformed("a text in a binary message is too long")
    try:
        return data[start:end].decode(), end
    except UnicodeDecodeError:
        raise Malformed("a text in a binary message is not UTF-8") from None


def message(op: str, **values: object) -> str:
    """Return a JSON message, without values that are None."""
    return msgspec.json.encode({"op": op} | {key: item for key, item in values.items() if item is not None}).decode()


def message_data(subscription: int, at: int, data: bytes) -> bytes:
    """Return a message of a topic; ``at``: ns since 1970."""
    return _DATA.pack(ServerOpcode.MESSAGE_DATA, subscription, at) + data


def time_message(at: int) -> bytes:
    """Return the server's time, ns since 1970."""
    return _TIME.pack(ServerOpcode.TIME, at)


def playback_state(state: Playback) -> bytes:
    """Return the message of a player's state."""
    name = state.request.encode()
    return (
        _STATE.pack(ServerOpcode.PLAYBACK_STATE, state.status, state.time, state.speed, state.sought, len(name)) + name
    )


def split_time(at: int) -> dict[str, int]:
    """Return ns since 1970 in the form of JSON messages."""
    return {"sec": at // 1_000_000_000, "nsec": at % 1_000_000_000}


def asset_failure(request: int, why: str) -> bytes:
    """Return the message of a failed request for a file."""
    text = why.encode()
    return _ASSET.pack(ServerOpcode.FETCH_ASSET_RESPONSE, request, 1, len(text)) + text
