"""Entries that wait to be written: values as they were handed over, and their encoding by kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from roboglot.model.tap import Exchange
from roboglot.recording import foxglove, messages
from roboglot.recording.redaction import Redaction

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
        """About how many bytes of memory it takes."""
        return len(self.value.payload) + 500 if isinstance(self.value, Exchange) else SCAN_BYTES


@dataclass(frozen=True, slots=True)
class Kind:
    """Encoding of one kind of value."""

    schema: str
    encode: Callable[[int, Any], bytes]

    @property
    def is_protobuf(self) -> bool:
        """True for messages of Foxglove's."""
        return self.schema in foxglove.TYPES

    @property
    def schema_data(self) -> bytes:
        """Schema as the file has it."""
        return foxglove.schema(self.schema) if self.is_protobuf else messages.SCHEMAS[self.schema]


def _plain(_at: int, value: object) -> bytes:
    return messages.encode_plain(value)


KINDS = {
    "exchange": Kind("roboglot.Exchange", lambda _at, value: messages.encode_exchange(value)),
    "input": Kind("roboglot.Input", lambda _at, value: messages.encode_input(value)),
    "event": Kind("roboglot.Event", _plain),
    "action": Kind("roboglot.Action", _plain),
    "battery": Kind("roboglot.Battery", _plain),
    "pressure": Kind("roboglot.Pressure", _plain),
    "state": Kind("roboglot.State", _plain),
    "mark": Kind("roboglot.Mark", _plain),
    "pose": Kind("foxglove.PoseInFrame", foxglove.encode_pose),
    "transforms": Kind("foxglove.FrameTransforms", foxglove.encode_transforms),
    "scan": Kind("foxglove.LaserScan", foxglove.encode_scan),
    "grid": Kind("foxglove.Grid", foxglove.encode_grid),
    "log": Kind("foxglove.Log", foxglove.encode_log),
    "scene": Kind("foxglove.SceneUpdate", foxglove.encode_scene),
    "video": Kind("foxglove.CompressedVideo", foxglove.encode_video),
}


def encoded(entry: Entry, redaction: Redaction) -> bytes:
    """Return an entry as a message, without what must stay secret."""
    kind, value = KINDS[entry.kind], entry.value
    if entry.kind == "exchange":
        value = redaction.exchange(value)
    data = kind.encode(entry.at, value)
    return data if kind.is_protobuf or entry.kind == "exchange" else redaction(data)
