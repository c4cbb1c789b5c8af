"""Two recordings of what should have been the same: the first message in which they differ, with its surroundings."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, zip_longest
from pathlib import Path

from roboglot.recording.entries import NANO
from roboglot.recording.reader import Record, read_messages

AROUND = 5  # messages before the first difference
SHOWN_MAX = 300  # characters of one
LEFT_OUT = frozenset({"/log"})  # lines of the log name ports
OTHER_ENDS = ("connection", "client")  # of an exchange: ports of clients


@dataclass(frozen=True, slots=True)
class Difference:
    """The first one: what was recorded and what came now, in words, and what both agreed on just before."""

    topic: str
    before: Sequence[str]
    recorded: str
    now: str


@dataclass(frozen=True, slots=True)
class Verdict:
    """Number of messages that agreed, and the first that did not; None: the traces are identical."""

    agreed: int
    difference: Difference | None


def difference(recorded: Path, now: Path) -> Verdict:
    """Compare the messages of two files: topic, robot time and bytes, in order. Raises BadRecording, OSError.

    Within one instant the order counts in each topic, and there among requests, among replies and among pushes: which
    of two that do not wait for each other comes first is the machine's affair.
    """
    around: deque[str] = deque(maxlen=AROUND)
    agreed = 0
    for one, other in zip_longest(_messages(recorded), _messages(now)):
        if one != other:
            topic = (one or other or ("",))[0]
            return Verdict(agreed, Difference(topic, tuple(around), _words(one), _words(other)))
        agreed += 1
        around.append(_words(one))
    return Verdict(agreed, None)


def _messages(path: Path) -> Iterator[tuple[str, int, bytes]]:
    counted = (record for record in read_messages(path) if record.topic not in LEFT_OUT and not _is_heartbeat(record))
    for at, records in groupby(counted, lambda record: record.at):
        for record in sorted(records, key=_stream):
            yield record.topic, at, _bytes(record)


def _is_heartbeat(record: Record) -> bool:
    """A dog's, which come from when its app is connected on: as soon as the machine has done that."""
    return record.topic.endswith("/cyberdog") and bool(record.json()["operation"] == "heartbeat")


def _stream(record: Record) -> tuple[str, str]:
    """Return the stream in which a message has its order: its topic, and the direction of an exchange."""
    return record.topic, record.json()["direction"] if record.schema == "roboglot.Exchange" else ""


def _bytes(record: Record) -> bytes:
    if record.schema != "roboglot.Exchange":
        return record.data
    value: dict[str, object] = record.json()
    for name in OTHER_ENDS:
        value.pop(name, None)
    return json.dumps(value, sort_keys=True).encode()


def _words(message: tuple[str, int, bytes] | None) -> str:
    if message is None:
        return "(no message any more)"
    topic, at, data = message
    text = data.decode("utf-8", "backslashreplace") if data[:1] == b"{" else f"{len(data)} bytes: {data.hex(' ')}"
    return f"{at / NANO % 1e6:.6f} {topic} {text[:SHOWN_MAX]}"
