"""Our own messages in a recording, as JSON: exchanges of the doors, events, actions, slowly changing state.

A payload is the concatenation of ``text``, ``json`` and ``base64``, each if present: so viewers see JSON as JSON, and
every byte of the vendor's message can be restored.
"""

from __future__ import annotations

import base64
import dataclasses
import json
from collections.abc import Mapping
from enum import Enum
from typing import Any

import msgspec
import numpy as np

from roboglot.model.inputs.external import Input
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.readings import READINGS
from roboglot.validation import decode_json

DEPTH_MAX = 6
ITEMS_MAX = 200  # of a list in an event
_encode = msgspec.json.Encoder().encode
_parsed = msgspec.json.Decoder()


class StoredExchange(msgspec.Struct, omit_defaults=True):
    """An exchange as written to the file; see ``model/tap.py`` for the fields."""

    stamp: float
    robot: str
    door: str
    connection: str
    client: str
    direction: str
    operation: str
    status: str = ""
    refusal: str = ""
    seconds: float = 0.0
    turn: int = -1
    text: str = ""
    json: msgspec.Raw | msgspec.UnsetType = msgspec.UNSET
    base64: str = ""


def split(payload: bytes) -> tuple[str, bytes, bytes]:
    """Return the text, the JSON and the remaining bytes of ``payload``, in that order; their sum is ``payload``."""
    head, blank, body = payload.partition(b"\n\n") if payload[:1] not in b"{[" else (b"", b"", payload)
    try:
        if body[:1] in (b"{", b"[") and body[-1:] in (b"}", b"]"):
            start = (head + blank).decode()
            body.decode()
            _parsed.decode(body)
            return start, body, b""
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        pass
    try:
        return payload.decode(), b"", b""
    except UnicodeDecodeError:
        return "", b"", payload


def encode_exchange(exchange: Exchange) -> bytes:
    """Return the exchange as a message of the file."""
    text, body, rest = split(exchange.payload)
    return _encode(
        StoredExchange(
            exchange.stamp,
            exchange.robot,
            exchange.door,
            exchange.connection,
            exchange.client,
            str(exchange.direction),
            exchange.operation,
            exchange.status,
            exchange.refusal,
            exchange.seconds,
            exchange.turn,
            text,
            msgspec.Raw(body) if body else msgspec.UNSET,
            base64.b64encode(rest).decode() if rest else "",
        )
    )


def decode_exchange(data: bytes) -> Exchange:
    """Return the exchange of a message. Raises msgspec.DecodeError, ValueError."""
    kept = decode_json(data, StoredExchange)
    body = b"" if kept.json is msgspec.UNSET else bytes(kept.json)
    payload = kept.text.encode() + body + (base64.b64decode(kept.base64) if kept.base64 else b"")
    return Exchange(
        kept.stamp,
        kept.robot,
        kept.door,
        kept.connection,
        kept.client,
        Direction(kept.direction),
        kept.operation,
        payload,
        kept.status,
        kept.refusal,
        kept.seconds,
        kept.turn,
    )


def encode_input(given: Input) -> bytes:
    """Return an external input as a message of the file."""
    return _encode(given._asdict())


def decode_input(data: bytes) -> Input:
    """Return the input of a message. Raises msgspec.DecodeError."""
    value = decode_json(data, dict[str, object])
    return msgspec.convert([value.get(name) for name in Input._fields], Input)


def encode_plain(value: object) -> bytes:
    """Return any value of the model as JSON, with its own field names."""
    return _encode(plain(value))


def plain(value: Any, depth: int = 0) -> Any:
    """Return ``value`` in JSON's types; values too deep, too long or unknown are left out or named."""
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if value == value and abs(value) != float("inf") else str(value)
    if isinstance(value, Enum):
        return value.name.lower()
    if depth >= DEPTH_MAX:
        return type(value).__name__
    return _plain_inside(value, depth + 1)


def _plain_inside(value: object, depth: int) -> object:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name), depth) for f in dataclasses.fields(value)}
    if isinstance(value, msgspec.Struct):
        return {name: plain(item, depth) for name, item in msgspec.structs.asdict(value).items()}
    if isinstance(value, Mapping):
        return {str(key): plain(item, depth) for key, item in list(value.items())[:ITEMS_MAX]}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item, depth) for item in list(value)[:ITEMS_MAX]]
    if isinstance(value, np.generic):
        return plain(value.item(), depth)
    if isinstance(value, np.ndarray):
        return {"shape": list(value.shape)}
    if isinstance(value, bytes):
        return {"bytes": len(value)}
    return getattr(value, "name", None) if isinstance(getattr(value, "name", None), str) else type(value).__name__


_TEXT, _NUMBER = {"type": "string"}, {"type": "number"}


def _schema(title: str, **properties: Mapping[str, object]) -> bytes:
    return json.dumps({"title": title, "type": "object", "properties": properties}).encode()


SCHEMAS = {  # JSON schemas, by name
    "roboglot.Exchange": _schema(
        "roboglot.Exchange",
        stamp=_NUMBER,
        robot=_TEXT,
        door=_TEXT,
        connection=_TEXT,
        client=_TEXT,
        direction={"type": "string", "enum": [str(direction) for direction in Direction]},
        operation=_TEXT,
        status=_TEXT,
        refusal=_TEXT,
        seconds=_NUMBER,
        turn={"type": "integer"},
        text=_TEXT,
        json={},
        base64=_TEXT,
    ),
    "roboglot.Event": _schema("roboglot.Event", event=_TEXT, stamp=_NUMBER),
    "roboglot.Action": _schema(
        "roboglot.Action",
        id={"type": "integer"},
        name=_TEXT,
        status=_TEXT,
        source=_TEXT,
        client=_TEXT,
        reason=_TEXT,
        paused={"type": "boolean"},
    ),
    "roboglot.Battery": _schema(
        "roboglot.Battery", percentage=_NUMBER, voltage=_NUMBER, current=_NUMBER, charging={"type": "boolean"}
    ),
    "roboglot.Lidar": _schema(
        "roboglot.Lidar",
        range_min=_NUMBER,
        range_max=_NUMBER,
        clear_range=_NUMBER,
        time_increment=_NUMBER,
        rate=_NUMBER,
    ),
    "roboglot.State": _schema("roboglot.State"),
    "roboglot.Input": _schema(
        "roboglot.Input",
        stamp=_NUMBER,
        turn={"type": "integer"},
        robot=_TEXT,
        kind=_TEXT,
        name=_TEXT,
        values={"type": "object"},
        client=_TEXT,
        connection=_TEXT,
    ),
    "roboglot.Mark": _schema("roboglot.Mark", text=_TEXT),
    **{reading.schema: _schema(reading.schema, **dict.fromkeys(reading.names, _NUMBER)) for reading in READINGS},
}
