"""Two recordings of what should have been the same: the first message in which they differ, with its surroundings."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, zip_longest
from pathlib import Path

from roboglot.model.inputs.outside import ANSWER
from roboglot.model.tap import Direction
from roboglot.recording.entries import NANO
from roboglot.recording.reader import Record, read_messages

AROUND = 5  # messages shown before the first difference
SHOWN_MAX = 300  # characters per message
LEFT_OUT = frozenset({"/log"})  # log lines contain ports
UNCOUNTED = ("connection", "client", "turn")  # of exchanges and inputs: ports of clients, and a visible order


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

    Within one instant the order counts in each topic, and there among requests, among replies and among pushes of one
    kind: which of two that do not wait for each other comes first is the machine's affair.
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
    counted = (record for record in read_messages(path) if record.topic not in LEFT_OUT)
    for at, records in groupby(counted, lambda record: record.at):
        for record in sorted(records, key=_stream):
            yield record.topic, at, _bytes(record)


def _stream(record: Record) -> tuple[str, str, str]:
    """Return what a message has an order in: its topic, and the direction of an exchange; a push also its operation."""
    if record.schema == "roboglot.Input":
        value = record.json()
        return record.topic, value["kind"], value["name"] if value["kind"] == ANSWER else ""
    if record.schema != "roboglot.Exchange":
        return record.topic, "", ""
    value = record.json()
    return record.topic, value["direction"], value["operation"] if value["direction"] == Direction.PUSH else ""


def _bytes(record: Record) -> bytes:
    if record.schema not in ("roboglot.Exchange", "roboglot.Input"):
        return record.data
    value: dict[str, object] = record.json()
    for name in UNCOUNTED:
        value.pop(name, None)
    return json.dumps(value, sort_keys=True).encode()


def _words(message: tuple[str, int, bytes] | None) -> str:
    if message is None:
        return "(no message any more)"
    topic, at, data = message
    text = data.decode("utf-8", "backslashreplace") if data[:1] == b"{" else f"{len(data)} bytes: {data.hex(' ')}"
    return f"{at / NANO % 1e6:.6f} {topic} {text[:SHOWN_MAX]}"
