"""Writes entries into MCAP files: chunks closed once a second, a new file at a limit, old ones deleted at another."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import field
from datetime import UTC, datetime
from errno import EEXIST
from pathlib import Path
from struct import Struct, pack
from typing import IO, Any
from zlib import crc32

from mcap.opcode import Opcode
from mcap.records import ChunkIndex
from mcap.writer import CompressionType, Writer
from zstandard import ZstdCompressor

from roboglot.recording.entries import KINDS, NANO, Encode, Entry, encoding_of
from roboglot.recording.latched_values import REPEATED, LatchedValues
from roboglot.recording.redaction import Redaction
from roboglot.values import dataclass

log = logging.getLogger(__name__)
LIBRARY = "roboglot"
SUFFIX = ".mcap"
ZSTD = b"zstd"
_message, _chunk_head = Struct("<BQHIQQ").pack, Struct("<BQQQQII4sQ")
RECORD_HEAD = 9  # bytes
LEVEL = 1  # of zstd: scans and poses become smaller than by the usual 3, in half the time
CHUNK_BYTES = 4 << 20  # of a second's messages before compression; more go into further chunks


@dataclass(frozen=True, slots=True)
class Attachment:
    """A file attached to the recording unchanged."""

    name: str
    media_type: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Origin:
    """Origin of a recording: facts by name, and the files that made the world and the bodies."""

    facts: Mapping[str, str] = field(default_factory=dict)
    attachments: Sequence[Attachment] = ()


@dataclass(frozen=True, slots=True)
class Limits:
    """Maximum size (bytes) and duration (s of robot time) of a part; maximum size of all parts together (bytes)."""

    part_bytes: int = 256 << 20
    part_seconds: float = 3600.0
    total_bytes: int = 4 << 30


class Channel:
    """A topic of one kind: its number in the file, its encoding, and its messages in the open chunk."""

    __slots__ = ("encode", "index", "number")

    def __init__(self, number: int, encode: Encode) -> None:
        self.number, self.encode = number, encode
        self.index: list[int] = []  # time, offset, time, offset, …


class OpenChunk:
    """Messages collected beside the library's writer, which would take five times as long, and their compression.

    The library writes new schemas and channels, before the messages.
    """

    def __init__(self, writer: Writer, file: IO[bytes], level: int = LEVEL) -> None:
        inside = vars(writer)
        self._head, self._figures = inside["_Writer__chunk_builder"], inside["_Writer__statistics"]
        self._chunks: list[ChunkIndex] = inside["_Writer__chunk_indices"]
        self._file, self._compress = file, ZstdCompressor(level).compress
        self._records: list[bytes] = []
        self._channels: list[Channel] = []  # those with messages
        self.size = 0  # bytes

    def add(self, channel: Channel, at: int, data: bytes, wall: int, sequence: int) -> None:
        """Add a message; ``at`` and ``wall`` in ns."""
        size, index = len(data), channel.index
        self._records += _message(Opcode.MESSAGE, size + 22, channel.number, sequence, at, wall), data
        if not index:
            self._channels.append(channel)
        index += at, self.size
        self.size += size + 31

    def write(self) -> None:
        """Write all messages to the file. Raises OSError."""
        if not self._records:
            return
        head = bytes(self._head.record_writer.end())
        times = [at for channel in self._channels for at in channel.index[::2]]
        first, last = min(times), max(times)
        body = b"".join((head, *self._records))
        packed = self._compress(body)
        chunk = _chunk(first, last, body, packed)
        begin, size = self._file.tell(), len(chunk)
        places, parts, at = dict[int, int](), [chunk], begin + size
        for channel in self._channels:
            places[channel.number] = at
            parts.append(_message_index(channel, len(head)))
            at += len(parts[-1])
        self._file.write(b"".join(parts))
        self._chunks.append(
            ChunkIndex(
                message_start_time=first,
                message_end_time=last,
                chunk_start_offset=begin,
                chunk_length=size,
                message_index_offsets=places,
                message_index_length=at - begin - size,
                compression=ZSTD.decode(),
                compressed_size=len(packed),
                uncompressed_size=len(body),
            )
        )
        self._count(first, last, len(times))

    def _count(self, first: int, last: int, messages: int) -> None:
        """Count the messages for the summary, and begin the next chunk."""
        figures = self._figures
        for channel in self._channels:
            figures.channel_message_counts[channel.number] += len(channel.index) // 2
            channel.index.clear()
        figures.message_start_time = min(first, figures.message_start_time) if figures.message_count else first
        figures.message_end_time = max(last, figures.message_end_time)
        figures.message_count += messages
        figures.chunk_count += 1
        self._records, self._channels, self.size = [], [], 0


def _chunk(first: int, last: int, body: bytes, packed: bytes) -> bytes:
    """Return the record of a chunk, of the times ``first`` to ``last`` (ns)."""
    size = _chunk_head.size - RECORD_HEAD + len(packed)
    head = Opcode.CHUNK, size, first, last, len(body), crc32(body), len(ZSTD), ZSTD, len(packed)
    return _chunk_head.pack(*head) + packed


def _message_index(channel: Channel, before: int) -> bytes:
    """Return the record of a channel's messages in a chunk; ``before``: bytes before the first message."""
    flat = channel.index
    flat[1::2] = [offset + before for offset in flat[1::2]]
    size = 8 * len(flat)
    return pack(f"<BQHI{len(flat)}Q", Opcode.MESSAGE_INDEX, size + 6, channel.number, size, *flat)


class PartWriter:
    """One MCAP file. Entries survive the death of the process once ``flush`` has returned."""

    def __init__(self, path: Path, origin: Origin, redaction: Redaction, at: int, part: int = 1) -> None:
        self.path, self._redaction = path, redaction
        self._file: IO[bytes] = path.open("xb", buffering=1 << 20)
        os.fchmod(self._file.fileno(), 0o600)
        self._writer: Any = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._chunk = OpenChunk(self._writer, self._file)
        self._channels: dict[tuple[str, str], Channel] = {}
        self._schemas: dict[str, int] = {}
        self._sequence = 0
        self.first = at
        self.size = 0  # bytes so far, without the open chunk
        try:
            self._begin(origin, at, part)
        except OSError:  # another try may have the same name
            path.unlink()
            with suppress(OSError):
                self._file.close()
            raise

    def _begin(self, origin: Origin, at: int, part: int) -> None:
        self._writer.start(profile="", library=LIBRARY)
        begun = datetime.now(UTC).isoformat(timespec="milliseconds")
        self._writer.add_metadata("roboglot", {**origin.facts, "begun": begun, "part": str(part)})
        for attachment in origin.attachments:
            self._writer.add_attachment(at, at, attachment.name, attachment.media_type, attachment.data)
        self.flush()

    def write(self, entry: Entry) -> None:
        """Add an entry."""
        self._sequence += 1
        self._add(entry, self._sequence)

    def repeat(self, entry: Entry) -> None:
        """Add an entry that an earlier part has, too; readers of both parts skip it."""
        self._add(entry, REPEATED)

    def _add(self, entry: Entry, sequence: int) -> None:
        topic, kind, at, wall, value = entry
        channel = self._channels.get((topic, kind)) or self._channel(entry)
        self._chunk.add(channel, at, channel.encode(at, value), wall, sequence)
        if self._chunk.size > CHUNK_BYTES:
            self._chunk.write()

    def _channel(self, entry: Entry) -> Channel:
        kind = KINDS[entry.kind]
        if (schema := self._schemas.get(kind.schema)) is None:
            encoding = "protobuf" if kind.is_protobuf else "jsonschema"
            schema = self._schemas[kind.schema] = self._writer.register_schema(kind.schema, encoding, kind.schema_data)
        encoding = "protobuf" if kind.is_protobuf else "json"
        number: int = self._writer.register_channel(entry.topic, encoding, schema)
        channel = self._channels[entry.topic, entry.kind] = Channel(number, encoding_of(entry.kind, self._redaction))
        return channel

    def flush(self) -> None:
        """Close the chunk and hand everything to the system. Raises OSError."""
        self._chunk.write()
        self._writer.flush()
        self.size = self._file.tell()

    def close(self) -> None:
        """Write the summary. Raises OSError."""
        try:
            self._chunk.write()
            self._writer.finish()
        finally:
            self._file.close()


class Files:
    """The parts of one recording: ``PATH.mcap``, then ``PATH-002.mcap`` and so on; in a folder, names are generated.

    Each part begins with the latched values, so that it can be read without the parts before it.
    """

    def __init__(self, path: Path, origin: Origin, redaction: Redaction, limits: Limits) -> None:
        self._base = path.with_suffix("") if path.suffix == SUFFIX else path
        self._origin, self._redaction, self._limits = origin, redaction, limits
        self._part: PartWriter | None = None
        self._number = 0
        self._closed: list[tuple[Path, int]] = []
        self._latched = LatchedValues()
        self.written = 0  # entries
        self.deleted = 0  # parts

    @property
    def path(self) -> Path:
        """Path of the current part, or of the first one before ``open``."""
        return self._path(self._number)

    def _path(self, number: int) -> Path:
        suffix = f"-{number:03}" if number > 1 else ""
        return self._base.with_name(f"{self._base.name}{suffix}{SUFFIX}")

    @property
    def size(self) -> int:
        """Size of all kept parts, bytes."""
        return sum(size for _, size in self._closed) + (self._part.size if self._part else 0)

    def open(self, at: int) -> None:
        """Create the first part, so that an unwritable path fails at once. Raises OSError."""
        if (second := self._path(2)).exists():  # of another recording; readers would take it for one of this
            raise FileExistsError(EEXIST, os.strerror(EEXIST), str(second))
        self._next(at)

    def write(self, entry: Entry) -> None:
        """Add an entry; begin the next part if this one is full. Raises OSError."""
        part = self._part or self._next(entry.at)
        full = part.size > self._limits.part_bytes or entry.at - part.first > self._limits.part_seconds * NANO
        if full:
            part = self._next(entry.at)
        part.write(entry)
        self._latched.note(entry)
        self.written += 1

    def flush(self) -> None:
        """See ``PartWriter.flush``."""
        if self._part is not None:
            self._part.flush()

    def close(self) -> None:
        """End the last part. Raises OSError."""
        if (part := self._part) is not None:
            self._part = None
            try:
                part.close()
            finally:  # flushed entries are in the file even if the disk is full
                self._closed.append((part.path, part.path.stat().st_size))

    def _next(self, at: int) -> PartWriter:
        self.close()
        while len(self._closed) > 1 and self.size > self._limits.total_bytes:
            path, _ = self._closed.pop(0)
            path.unlink(missing_ok=True)
            self.deleted += 1
            log.warning("recording: deleted %s, all parts may take %d bytes", path, self._limits.total_bytes)
        self._number += 1
        self._part = PartWriter(self.path, self._origin, self._redaction, at, self._number)
        for entry in self._latched.at(at):
            self._part.repeat(entry)
        return self._part
