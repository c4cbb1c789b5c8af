"""Reads a recording: exchanges, events, marks, facts, files; even if its program was killed while writing."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator, Sequence
from dataclasses import field
from datetime import UTC, datetime
from os import SEEK_END
from pathlib import Path
from typing import IO, Any

from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.summary import Summary
from msgspec import DecodeError

from roboglot.model.inputs.external import Input
from roboglot.model.tap import DRIVER, SILENT, Direction, Exchange
from roboglot.recording.latched_values import REPEATED
from roboglot.recording.messages import decode_exchange, decode_input
from roboglot.text_files import open_bytes
from roboglot.validation import decode_json
from roboglot.values import dataclass
from roboglot.wire.mcap_chunks import Allowance, Bomb, records_in
from roboglot.wire.mcap_damage import DAMAGE, RECORD_MAX

log = logging.getLogger(__name__)
EXCHANGES_MAX = 2_000_000


class BadRecording(ValueError):
    """The file is not a recording of roboglot's; the message gives the reason."""


@dataclass(slots=True)
class Record:
    """One message of the file: topic, schema, robot time in ns since 1970, and its bytes."""

    topic: str
    schema: str
    at: int
    data: bytes

    def json(self) -> Any:
        """Return a JSON message's object. Raises msgspec.DecodeError, also if it is something else."""
        return decode_json(self.data, dict[str, object])


@dataclass(slots=True)
class Recording:
    """``whole`` is False if the file has no end: its program was killed, or is still writing."""

    path: Path
    facts: dict[str, str] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    exchanges: list[Exchange] = field(default_factory=list)
    inputs: list[tuple[int, Input]] = field(default_factory=list)  # with the number of exchanges before each
    topics: dict[str, int] = field(default_factory=dict)
    first: int = 0
    last: int = 0
    whole: bool = False
    epoch: float = 0.0  # calendar time at robot time 0, Unix s

    @property
    def robots(self) -> Sequence[str]:
        """Names of the robots with exchanges, sorted."""
        return sorted({exchange.robot for exchange in self.exchanges})

    @property
    def all_robots(self) -> Sequence[str]:
        """Names of all robots in it, also of those without exchanges, sorted."""
        return sorted({topic.split("/")[1] for topic in self.topics if topic.count("/") > 1} - {"truth"})

    @property
    def seconds(self) -> float:
        """Duration in robot time, s."""
        return (self.last - self.first) / 1e9

    def session(self, robot: str = "", door: str = "") -> list[Exchange]:
        """Return the exchanges of a robot (empty: the only one) at a door (empty: any). Raises BadRecording."""
        if not robot and len(self.robots) > 1:
            raise BadRecording(f"{self.path} has the robots {', '.join(self.robots)}: choose one with --robot")
        if not (found := self.of(robot, door)):
            raise BadRecording(f"{self.path} has no message of that robot and protocol")
        return found

    def of(self, robot: str = "", door: str = "") -> list[Exchange]:
        """Return the exchanges of a robot (empty: all) at a door (empty: all)."""
        return [e for e in self.exchanges if robot in ("", e.robot) and door in ("", e.door)]


@dataclass(slots=True)
class AnsweredRequest:
    """A request with all its replies, and their indices in the recording."""

    number: int
    request: Exchange
    numbered: list[tuple[int, Exchange]] = field(default_factory=list)

    @property
    def replies(self) -> list[Exchange]:
        """The replies without their indices; no reply is none."""
        return [reply for _, reply in self.numbered if reply.status != SILENT]


def pair(exchanges: Sequence[Exchange]) -> tuple[list[AnsweredRequest], list[tuple[int, Exchange]]]:
    """Return requests with their replies, and pushes; each with its index among all exchanges."""
    asked: list[AnsweredRequest] = []
    pushes: list[tuple[int, Exchange]] = []
    waiting: dict[tuple[str, str, str, str], list[AnsweredRequest]] = {}
    for number, exchange in enumerate(exchanges):
        key = exchange.robot, exchange.door, exchange.connection, exchange.operation
        match exchange.direction:
            case Direction.REQUEST:
                found = AnsweredRequest(number, exchange)
                asked.append(found)
                waiting.setdefault(key, []).append(found)
            case Direction.REPLY:
                _answer(waiting.get(key, []), number, exchange)
            case Direction.PUSH:
                pushes.append((number, exchange))
    return asked, pushes


def _answer(open_ones: list[AnsweredRequest], number: int, reply: Exchange) -> None:
    """Add the reply to its request, found by the request's time."""
    if not open_ones:
        return
    began = reply.stamp - reply.seconds
    exact = [asked for asked in open_ones if abs(asked.request.stamp - began) <= 1e-6]
    # A dog answers a request more than once, at its door and to its driver; of two at once the newer one is meant.
    often = reply.door.removeprefix(DRIVER) == "cyberdog"
    if often or not exact:  # recordings of older versions lack the time of the request
        best = (exact or open_ones)[-1]
    else:
        best = min(exact, key=lambda asked: (len(asked.numbered) > 0, asked.number))
    best.numbered.append((number, reply))
    if len(open_ones) > 1 and not often:
        open_ones.remove(best)
    del open_ones[:-64]


def records(path: Path) -> Iterator[tuple[object, Channel | None, Schema | None]]:
    """Yield the records of the file, messages with their channel and schema; ends where the file is cut off.

    Raises BadRecording, OSError.
    """
    with open_bytes(path) as file:
        summary = summary_of(file)
        channels = {} if summary is None else summary.channels
        schemas = {} if summary is None else summary.schemas
        file.seek(0)
        for record in stream(path, file):
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                channels[record.id] = record
            channel = channels.get(record.channel_id) if isinstance(record, Message) else None
            yield record, channel, schemas.get(channel.schema_id) if channel else None


def stream(path: Path, file: IO[bytes], *, chunks: bool = False) -> Iterator[McapRecord]:
    """Yield the records of an open file, with ``chunks`` undivided chunks; ends where the file is cut off.

    Damaged chunks are left out, with a warning, and so is then the footer. Raises BadRecording, OSError.
    """
    is_damaged, allowance = False, Allowance(file)
    for record in _undivided(path, file):
        if isinstance(record, Chunk):
            try:
                allowance.take(record)
            except Bomb as error:
                raise BadRecording(f"{path}: {error}") from None
        if isinstance(record, Chunk) and not chunks:
            try:
                yield from unpacked(path, record)
            except BadRecording as error:
                is_damaged = True
                seconds = (record.message_end_time - record.message_start_time) / 1e9
                log.warning("%s; %.1f s are left out", error, seconds)
        elif not (is_damaged and isinstance(record, Footer)):
            yield record


def _undivided(path: Path, file: IO[bytes]) -> Iterator[McapRecord]:
    """Yield the records with undivided chunks; warn of missing messages at the end. Raises BadRecording, OSError."""
    first, last, read = -1, 0, 0
    has_all = False
    try:
        for record in StreamReader(file, emit_chunks=True, record_size_limit=RECORD_MAX).records:
            read = file.tell()
            if isinstance(record, Chunk):
                last = max(last, record.message_end_time)
                first = record.message_start_time if first < 0 else min(first, record.message_start_time)
            has_all = has_all or isinstance(record, DataEnd)
            yield record
    except DAMAGE as error:
        if isinstance(error, McapError) and file.tell() <= 16:
            why = f"{path} is not an MCAP file"
            raise BadRecording(why) from None
    if not has_all:
        log.warning("%s is cut off: %s", path, _readable(first, last, file.seek(0, SEEK_END) - read))


def _readable(first: int, last: int, rest: int) -> str:
    """Return what was read of a file that is cut off: up to a time (ns), and without ``rest`` bytes."""
    until = f"{(last - first) / 1e9:.1f} s ({datetime.fromtimestamp(last / 1e9, UTC):%F %T} UTC)"
    found = "it has no messages" if first < 0 else f"it is read until {until}"
    return found + f"; the last {f'{rest} bytes are' if rest > 1 else 'byte is'} not a whole record" * (rest > 0)


def unpacked(path: Path, chunk: Chunk) -> Sequence[McapRecord]:
    """Return the records of a chunk. Raises BadRecording; MemoryError if it is too large, which is no damage."""
    try:
        return records_in(chunk)
    except MemoryError:
        raise
    except DAMAGE as error:
        raise BadRecording(f"{path} is damaged: {error}") from None


def summary_of(file: IO[bytes]) -> Summary | None:
    """Return the index of a whole file."""
    try:
        summary = SeekingReader(file, record_size_limit=RECORD_MAX).get_summary()
    except (OSError, *DAMAGE):
        return None
    return summary if summary is not None and summary.chunk_indexes else None


def read_recording(path: Path) -> Recording:
    """Read the file at ``path`` and the parts that follow it. Raises BadRecording, OSError."""
    recording = Recording(path)
    for part in parts(path):
        read_part(part, recording, first=part == path)
    if "version" not in recording.facts:
        raise BadRecording(f"{path} is not a recording of roboglot")
    return recording


def parts(path: Path) -> Sequence[Path]:
    """Return the files of a recording, in order."""
    found, stem, number = [path], path.stem, 2
    if (numbered := re.fullmatch(r"(.+)-(\d{3,})", stem)) and _part_of(path) == numbered[2].lstrip("0") != "1":
        stem, number = numbered[1], int(numbered[2]) + 1  # earlier parts were deleted, or are not wanted
    while path.name and (following := path.with_name(f"{stem}-{number:03}{path.suffix}")).exists():
        found.append(following)
        number += 1
    return found


def _part_of(path: Path) -> str:
    """Return the number in a part's metadata; empty if there is none."""
    found = (record for record, *_ in records(path) if isinstance(record, Metadata) and record.name == "roboglot")
    return str(next((record.metadata.get("part", "") for record in found), ""))


def read_part(path: Path, recording: Recording, *, first: bool) -> None:
    """Add what a file has; the ``first`` of a recording also has what others repeat. Raises BadRecording, OSError."""
    try:
        _read_records(path, recording, first=first)
    except BadRecording:
        raise
    except (DecodeError, ValueError, TypeError) as error:
        raise BadRecording(f"{path} has a message that cannot be read: {error}") from None


def _read_records(path: Path, recording: Recording, *, first: bool) -> None:
    recording.whole = False
    for record, channel, schema in records(path):
        match record:
            case Message(sequence=0) if not first:
                pass  # an earlier part has it
            case Metadata() | Attachment():
                note_head(recording, record)
            case Message() if channel is not None and schema is not None:
                _read_message(recording, record, channel.topic, schema.name)
            case Footer():
                recording.whole = True


def note_head(recording: Recording, record: object) -> None:
    """Keep the facts or the file of a record."""
    match record:
        case Metadata(name="roboglot"):
            facts = {key: value for key, value in record.metadata.items() if key != "part"}
            recording.facts = facts | recording.facts  # those of the first part, as when it was begun
        case Attachment():
            recording.attachments[record.name] = record.data


def _read_message(recording: Recording, record: Message, topic: str, kind: str) -> None:
    """Count a message; keep it if it is an input or an exchange."""
    recording.topics[topic] = recording.topics.get(topic, 0) + 1
    recording.first = min(recording.first or record.log_time, record.log_time)
    recording.last = max(recording.last, record.log_time)
    if kind == "roboglot.Input" and len(recording.inputs) < EXCHANGES_MAX:
        taken = decode_input(record.data)
        recording.inputs.append((len(recording.exchanges), taken))
        recording.epoch = recording.epoch or record.log_time / 1e9 - taken.stamp
    if kind == "roboglot.Exchange" and len(recording.exchanges) < EXCHANGES_MAX:
        exchange = decode_exchange(record.data)
        recording.exchanges.append(exchange)
        recording.epoch = recording.epoch or record.log_time / 1e9 - exchange.stamp


def read_messages(path: Path, *topics: str) -> Iterator[Record]:
    """Yield the messages of these topics (none: all), in the file's order. Raises BadRecording, OSError."""
    for part in parts(path):
        for record, channel, schema in records(part):
            if not isinstance(record, Message) or not channel or not schema or (topics and channel.topic not in topics):
                continue
            if part == path or record.sequence != REPEATED:
                yield Record(channel.topic, schema.name, record.log_time, record.data)
