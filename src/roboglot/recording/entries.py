"""Entries to be written: values as they were handed over, and their encoding by kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from roboglot.model.tap import Exchange
from roboglot.recording import foxglove, messages
from roboglot.recording.readings import READINGS
from roboglot.recording.redaction import Redaction
from roboglot.values import dataclass

SCAN_BYTES = 1500  # assumed for a queued value of unknown size
NANO = 1_000_000_000


class Entry(NamedTuple):
    """One value: its topic, its kind (a key of ``KINDS``), robot time and the machine's time, both in ns since 1970."""

    topic: str
    kind: str
    at: int
    wall: int
    value: Any

    @property
    def weight(self) -> int:
        """Approximate size in memory, bytes."""
        return len(self.value.payload) + 500 if isinstance(self.value, Exchange) else SCAN_BYTES


Put = Callable[[Entry], object]
Encode = Callable[[int, Any], bytes]  # of a time (ns) and a value


@dataclass(frozen=True, slots=True)
class EntryKind:
    """Encoding of one kind of value."""

    schema: str
    encode: Encode

    @property
    def is_protobuf(self) -> bool:
        """True if the schema is one of Foxglove's protobuf messages."""
        return self.schema in foxglove.TYPES

    @property
    def schema_data(self) -> bytes:
        """Schema as written to the file."""
        return foxglove.schema(self.schema) if self.is_protobuf else messages.SCHEMAS[self.schema]


def _plain(_at: int, value: object) -> bytes:
    return messages.encode_plain(value)


KINDS = {
    "exchange": EntryKind("roboglot.Exchange", lambda _at, value: messages.encode_exchange(value)),
    "input": EntryKind("roboglot.Input", lambda _at, value: messages.encode_input(value)),
    "event": EntryKind("roboglot.Event", _plain),
    "action": EntryKind("roboglot.Action", _plain),
    "battery": EntryKind("roboglot.Battery", _plain),
    "lidar": EntryKind("roboglot.Lidar", _plain),
    "state": EntryKind("roboglot.State", _plain),
    "mark": EntryKind("roboglot.Mark", _plain),
    "pose": EntryKind("foxglove.PoseInFrame", foxglove.encode_pose),
    "transforms": EntryKind("foxglove.FrameTransforms", foxglove.encode_transforms),
    "scan": EntryKind("foxglove.LaserScan", foxglove.encode_scan),
    "grid": EntryKind("foxglove.Grid", foxglove.encode_grid),
    "log": EntryKind("foxglove.Log", foxglove.encode_log),
    "scene": EntryKind("foxglove.SceneUpdate", foxglove.encode_scene),
    "video": EntryKind("foxglove.CompressedVideo", foxglove.encode_video),
    **{reading.topic: EntryKind(reading.schema, _plain) for reading in READINGS},
}


def encoding_of(kind: str, redaction: Redaction) -> Encode:
    """Return the function that makes a message of a value of this kind, with secrets redacted."""
    encode = KINDS[kind].encode
    if kind == "exchange":
        return lambda at, value: encode(at, redaction.exchange(value))
    if kind == "action":
        return lambda at, value: redaction(encode(at, redaction.action(value)))
    if kind == "log":
        return lambda at, value: encode(at, (*value[:2], redaction.text(value[2])))
    if KINDS[kind].is_protobuf:
        return encode
    return lambda at, value: redaction(encode(at, value))


def encoded(entry: Entry, redaction: Redaction) -> bytes:
    """Return an entry as a message, with secrets redacted."""
    return encoding_of(entry.kind, redaction)(entry.at, entry.value)
