"""Compares two recordings that should be equal: the first message that differs, with the messages before it."""

from __future__ import annotations

import json
import re
from collections import deque
from collections.abc import Iterator, Sequence
from itertools import groupby, zip_longest
from pathlib import Path

from roboglot.model.inputs.external import ANSWER, CAME, GONE
from roboglot.model.tap import Direction
from roboglot.recording.entries import NANO
from roboglot.recording.reader import Record, read_messages
from roboglot.values import dataclass

AROUND = 5  # messages shown before the first difference
SHOWN_MAX = 300  # characters per message
LEFT_OUT = frozenset({"/log"})  # log lines contain ports
COMING = frozenset({CAME, GONE})  # inputs that a rerun repeats by itself, or reports if it cannot
SAID = ("roboglot.Exchange", "roboglot.Input")
ADDRESS = re.compile(rb"((?:\d{1,3}\.){3}\d{1,3}|[0-9a-f]*:[0-9a-f:.]+):\d{1,5}(?!\d)")
HERE = b"127.0.0.1"  # where a rerun's clients are
UNCOUNTED = ("connection", "client", "turn")  # clients' addresses, and an order visible anyway


@dataclass(frozen=True, slots=True)
class Difference:
    """The first difference: the recorded and the new message as text, and the last messages on which both agree."""

    topic: str
    before: Sequence[str]
    recorded: str
    now: str


@dataclass(frozen=True, slots=True)
class Verdict:
    """Number of equal messages, and the first difference; None: the traces are identical."""

    agreed: int
    difference: Difference | None


def difference(recorded: Path, now: Path) -> Verdict:
    """Compare the messages of two files: topic, robot time and bytes, in order. Raises BadRecording, OSError.

    Within one instant, order counts per topic, among requests, among replies and among pushes of one kind only: the
    order of independent messages depends on the machine.
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
    counted = (record for record in read_messages(path) if _counts(record))
    ends = _Ends()
    for at, group in groupby(counted, lambda record: record.at):
        records = sorted(group, key=_stream)
        for record in records:
            ends.note(record)
        for record in records:
            yield record.topic, at, _bytes(record, ends)


def _counts(record: Record) -> bool:
    if record.schema == "roboglot.Input":
        return record.json()["kind"] not in COMING
    return record.topic not in LEFT_OUT


class _Ends:
    """Clients' addresses so far, which are in actions' sources, too.

    The machine chooses their ports, and in a rerun clients of other machines are on this one.
    """

    def __init__(self) -> None:
        self._seen: set[bytes] = set()
        self._hosts: set[bytes] = set()
        self._elsewhere: re.Pattern[bytes] | None = None

    def note(self, record: Record) -> None:
        """Remember the sender of an exchange."""
        if record.schema in SAID and (found := ADDRESS.search(str(record.json()["connection"]).encode())):
            self._seen.add(found[0])
            if found[1] != HERE and found[1] not in self._hosts:
                self._hosts.add(found[1])
                names = b"|".join(re.escape(host) for host in sorted(self._hosts, key=len, reverse=True))
                self._elsewhere = re.compile(rb"(?<![\w.:])(?:" + names + rb")(?![\w.:])")

    def without(self, data: bytes) -> bytes:
        """Return JSON without these addresses' ports and foreign hosts."""
        data = ADDRESS.sub(lambda found: found[1] if found[0] in self._seen else found[0], data)
        return data if self._elsewhere is None else self._elsewhere.sub(HERE, data)


def _stream(record: Record) -> tuple[str, str, str]:
    """Return the stream in which a message is ordered: topic, direction of an exchange, operation of a push."""
    if record.schema == "roboglot.Input":
        value = record.json()
        return record.topic, value["kind"], value["name"] if value["kind"] == ANSWER else ""
    if record.schema != "roboglot.Exchange":
        return record.topic, "", ""
    value = record.json()
    return record.topic, value["direction"], value["operation"] if value["direction"] == Direction.PUSH else ""


def _bytes(record: Record, ends: _Ends) -> bytes:
    if not record.schema.startswith("roboglot."):
        return record.data
    if record.schema not in SAID:
        return ends.without(record.data)
    value: dict[str, object] = record.json()
    for name in UNCOUNTED:
        value.pop(name, None)
    return ends.without(json.dumps(value, sort_keys=True).encode())


def _words(message: tuple[str, int, bytes] | None) -> str:
    if message is None:
        return "(no message any more)"
    topic, at, data = message
    text = data.decode("utf-8", "backslashreplace") if data[:1] == b"{" else f"{len(data)} bytes: {data.hex(' ')}"
    return f"{at / NANO % 1e6:.6f} {topic} {text[:SHOWN_MAX]}"
