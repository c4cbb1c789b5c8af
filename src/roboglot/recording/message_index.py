"""Finds messages of a recording by their time, reading only the necessary chunks, and counts them.

A whole file has an index; one that was cut off is read once, from the front.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import accumulate
from pathlib import Path
from struct import Struct
from typing import IO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, Chunk, McapRecord, Message, MetadataIndex, Schema
from mcap.stream_reader import StreamReader
from mcap.summary import Summary

from roboglot.recording.latched_values import REPEATED
from roboglot.recording.reader import (
    BadRecording,
    Recording,
    note_head,
    parts,
    read_part,
    stream,
    summary_of,
    unpacked,
)
from roboglot.text_files import open_bytes
from roboglot.values import dataclass
from roboglot.wire.mcap_damage import DAMAGE, RECORD_MAX

RECORD_HEAD = 9  # bytes: opcode and length
_chunk_start = Struct("<BQQQQ")  # of a chunk's record: head, times of its first and last message, unpacked size
TOPICS_MAX = 4096
WAITING_MAX = 1 << 30  # bytes of messages read ahead, because their chunks overlap
MESSAGE_BYTES = 150  # of a message, beside its data


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic and the encoding of its messages, from the file."""

    name: str
    encoding: str
    schema: str
    schema_encoding: str
    schema_data: bytes


class TimedMessage(NamedTuple):
    """One message: its time in ns since 1970, the index of its topic in ``MessageIndex.topics``, and its bytes."""

    at: int
    topic: int
    data: bytes


@dataclass(frozen=True, slots=True)
class _Part:
    """One file, and the indices of its channels in ``MessageIndex.topics``."""

    path: Path
    places: Mapping[int, int]


@dataclass(frozen=True, slots=True)
class _Chunk:
    """Chunk of the file with messages from ``first`` to ``last``, and the topics in it."""

    first: int
    last: int
    part: _Part
    offset: int
    topics: frozenset[int]


class MessageIndex:
    """The parts of one recording, each message once, in the order of their times."""

    def __init__(self, path: Path) -> None:
        """Raises BadRecording, OSError."""
        self.topics: list[Topic] = []
        found = [chunk for part in parts(path) for chunk in self._part(part)]
        if not found:
            raise BadRecording(f"{path} has no messages")
        self._chunks = sorted(found, key=lambda chunk: chunk.first)
        self._ends = list(accumulate((chunk.last for chunk in self._chunks), max))  # of each chunk and all before it

    @property
    def first(self) -> int:
        """Time of the first message, ns since 1970."""
        return self._chunks[0].first

    @property
    def end(self) -> int:
        """Time of the last message, ns since 1970."""
        return self._ends[-1]

    def only(self, topics: Collection[int]) -> Iterator[TimedMessage]:
        """Yield all messages of these topics, reading only chunks with one. Raises BadRecording, OSError."""
        for chunk in self._chunks:
            if not chunk.topics.isdisjoint(topics):
                yield from (message for message in self._read(chunk) if message.topic in topics)

    def play(self, since: int) -> Iterator[Sequence[TimedMessage]]:
        """Yield all messages at or after ``since`` (ns since 1970) in batches, ordered by time.

        Messages of the same time come together. Raises BadRecording, OSError.
        """
        waiting: list[TimedMessage] = []
        held = 0  # bytes in ``waiting``
        start = bisect_left(self._ends, since)
        for number, chunk in enumerate(self._chunks[start:], start + 1):
            if chunk.last >= since:
                new = [message for message in self._read(chunk) if message.at >= since]
                held += _bytes_of(new)
                if held > WAITING_MAX:
                    raise BadRecording(f"{chunk.part.path}: more than {WAITING_MAX} bytes in chunks of the same time")
                waiting += new
                waiting.sort(key=_time)
            until = self._chunks[number].first if number < len(self._chunks) else None
            ready = len(waiting) if until is None else _before(waiting, until)
            if ready:
                held -= _bytes_of(waiting[:ready])
                yield waiting[:ready]
                del waiting[:ready]

    def last(self, at: int, topics: Collection[int]) -> list[TimedMessage]:
        """Return the last message of each topic at or before ``at`` (ns since 1970). Raises BadRecording, OSError."""
        found: dict[int, TimedMessage] = {}
        for number in range(bisect_right(self._chunks, at, key=lambda chunk: chunk.first) - 1, -1, -1):
            # An entry is final when no earlier chunk reaches beyond it.
            sought = {place for place in topics if place not in found or found[place].at < self._ends[number]}
            if not sought:
                break
            chunk = self._chunks[number]
            for message in self._read(chunk) if sought & chunk.topics else ():
                if message.at <= at and message.topic in sought and message.at >= found.get(message.topic, message).at:
                    found[message.topic] = message
        return sorted(found.values(), key=_time)

    # -- files --

    def _part(self, path: Path) -> Iterator[_Chunk]:
        with open_bytes(path) as file:
            summary = summary_of(file)
            if summary is not None:
                yield from self._by_index(path, summary)
            else:
                file.seek(0)
                yield from self._by_reading(path, file)

    def _by_index(self, path: Path, summary: Summary) -> Iterator[_Chunk]:
        part = _Part(path, self._places(summary.channels.values(), summary.schemas))
        for row in summary.chunk_indexes:
            topics = frozenset(part.places[channel] for channel in row.message_index_offsets if channel in part.places)
            if topics:
                yield _Chunk(row.message_start_time, row.message_end_time, part, row.chunk_start_offset, topics)

    def _by_reading(self, path: Path, file: IO[bytes]) -> Iterator[_Chunk]:
        schemas: dict[int, Schema] = {}
        places: dict[int, int] = {}
        part, offset = _Part(path, places), 0
        for record in stream(path, file, chunks=True):
            if isinstance(record, Chunk):
                with suppress(BadRecording):  # what cannot be read here is skipped there, too
                    heard = self._heard_in(unpacked(path, record), schemas, places)
                    if topics := frozenset(places[channel] for channel in heard if channel in places):
                        yield _Chunk(record.message_start_time, record.message_end_time, part, offset, topics)
            offset = file.tell()

    def _heard_in(self, records: Sequence[object], schemas: dict[int, Schema], places: dict[int, int]) -> set[int]:
        """Return the channels with messages among a chunk's records; new ``schemas`` and ``places`` are added."""
        schemas |= {record.id: record for record in records if isinstance(record, Schema)}
        channels = [record for record in records if isinstance(record, Channel)]
        places |= self._places([new for new in channels if new.id not in places], schemas)
        return {record.channel_id for record in records if isinstance(record, Message)}

    def _places(self, channels: Collection[Channel], schemas: Mapping[int, Schema]) -> dict[int, int]:
        """Return the indices of these channels in ``topics``; new topics are added."""
        found = {}
        for channel in channels:
            if (schema := schemas.get(channel.schema_id)) is None:
                continue
            topic = Topic(channel.topic, channel.message_encoding, schema.name, schema.encoding, schema.data)
            if topic not in self.topics:
                if len(self.topics) >= TOPICS_MAX:
                    continue
                self.topics.append(topic)
            found[channel.id] = self.topics.index(topic)
        return found

    @staticmethod
    def _read(chunk: _Chunk) -> list[TimedMessage]:
        path, places = chunk.part.path, chunk.part.places
        try:
            with open_bytes(path) as file:
                file.seek(chunk.offset + RECORD_HEAD)
                inside = unpacked(path, Chunk.read(ReadDataStream(file)))
        except DAMAGE as error:
            raise BadRecording(f"{path} is damaged: {error}") from None
        return [
            TimedMessage(message.log_time, places[message.channel_id], message.data)
            for message in inside
            if isinstance(message, Message) and message.channel_id in places
        ]


def _time(message: TimedMessage) -> int:
    return message.at


def _bytes_of(messages: Sequence[TimedMessage]) -> int:
    return sum(len(message.data) + MESSAGE_BYTES for message in messages)


def _before(messages: Sequence[TimedMessage], until: int) -> int:
    """Return the number of ``messages``, which are in order, before ``until`` (ns since 1970)."""
    return bisect_right(messages, until - 1, key=_time)


def read_outline(path: Path) -> Recording:
    """Return what ``read_recording`` does, without exchanges and inputs, from the index of each file that has one.

    Damage within chunks stays unnoticed there. Raises BadRecording, OSError.
    """
    recording = Recording(path)
    for part in parts(path):
        if not _outline_part(part, recording, first=part == path):
            read_part(part, recording, first=part == path)
    if "version" not in recording.facts:
        raise BadRecording(f"{path} is not a recording of roboglot")
    recording.exchanges, recording.inputs = [], []
    return recording


def _outline_part(path: Path, recording: Recording, *, first: bool) -> bool:
    """Add what the index of a file says; return False, adding nothing, if it has none that fits its chunks."""
    with open_bytes(path) as file:
        summary = summary_of(file)
        figures = None if summary is None else summary.statistics
        try:
            if summary is None or figures is None or not _fits(file, summary):
                return False
            counts = Counter(figures.channel_message_counts)
            if not first:
                counts.subtract(_repeated(path, file, summary))
            heads = _records_at(file, [*summary.metadata_indexes, *summary.attachment_indexes])
        except (BadRecording, *DAMAGE):
            return False
    for record in heads:
        note_head(recording, record)
    for number, count in counts.items():
        channel = summary.channels.get(number)
        if count > 0 and channel is not None and channel.schema_id in summary.schemas:
            recording.topics[channel.topic] = recording.topics.get(channel.topic, 0) + count
    if counts.total() > 0:
        recording.first = min(recording.first or figures.message_start_time, figures.message_start_time)
        recording.last = max(recording.last, figures.message_end_time)
    recording.whole = True
    return True


def _fits(file: IO[bytes], summary: Summary) -> bool:
    """Return whether an index is complete and in step with the chunks of the file."""
    figures = summary.statistics
    assert figures is not None
    counted = figures.chunk_count, figures.attachment_count, figures.metadata_count, figures.message_count
    listed = [len(rows) for rows in (summary.chunk_indexes, summary.attachment_indexes, summary.metadata_indexes)]
    if counted != (*listed, sum(figures.channel_message_counts.values())):
        return False
    for row in summary.chunk_indexes:
        file.seek(row.chunk_start_offset)
        times = row.message_start_time, row.message_end_time, row.uncompressed_size
        if _chunk_start.unpack(file.read(_chunk_start.size)) != (Opcode.CHUNK, row.chunk_length - RECORD_HEAD, *times):
            return False
    return True


def _repeated(path: Path, file: IO[bytes], summary: Summary) -> Counter[int]:
    """Count the messages at the beginning of a part, by channel, that an earlier part has, too."""
    found = Counter[int]()
    for row in sorted(summary.chunk_indexes, key=lambda row: row.chunk_start_offset):
        file.seek(row.chunk_start_offset + RECORD_HEAD)
        messages = [one for one in unpacked(path, Chunk.read(ReadDataStream(file))) if isinstance(one, Message)]
        again = [one.channel_id for one in messages if one.sequence == REPEATED]
        found.update(again)
        if len(again) < len(messages):
            break
    return found


def _records_at(file: IO[bytes], rows: Sequence[MetadataIndex | AttachmentIndex]) -> list[McapRecord]:
    """Return the metadata and attachments at these places. Raises errors of ``mcap_damage``."""
    found = []
    for row in rows:
        file.seek(row.offset)
        found.append(next(StreamReader(file, skip_magic=True, record_size_limit=RECORD_MAX).records))
    return found
