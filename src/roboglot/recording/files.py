"""Writes entries into MCAP files: chunks closed once a second, a new file at a limit, old ones deleted at another."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from struct import Struct, pack
from typing import IO, Any

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import MessageIndex
from mcap.writer import CompressionType, Writer

from roboglot.recording.entries import KINDS, NANO, Entry, encoded
from roboglot.recording.redaction import Redaction
from roboglot.recording.standing import REPEATED, Standing
from roboglot.values import dataclass

log = logging.getLogger(__name__)
LIBRARY = "roboglot"
SUFFIX = ".mcap"
_message = Struct("<BQHIQQ").pack
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


class OpenChunk:
    """Messages collected for the library's writer: handing them over together takes a fifth of the time."""

    def __init__(self, writer: Writer) -> None:
        inside = vars(writer)
        self._chunk, self._figures = inside["_Writer__chunk_builder"], inside["_Writer__statistics"]
        self._records: list[bytes] = []
        self._index: dict[int, list[int]] = {}  # of each channel: time, offset, time, offset, …
        self.size = 0  # bytes

    def add(self, channel: int, at: int, data: bytes, wall: int, sequence: int) -> None:
        """Add a message; ``at`` and ``wall`` in ns."""
        size = len(data)
        self._records += (_message(Opcode.MESSAGE, size + 22, channel, sequence, at, wall), data)
        self._index.setdefault(channel, []).extend((at, self.size))
        self.size += size + 31

    def hand_over(self) -> None:
        """Hand all messages to the writer; its next ``flush`` or ``finish`` writes them."""
        if not self._records:
            return
        chunk, figures = self._chunk, self._figures
        before = chunk.count  # channels and schemas that are new
        chunk.record_writer.write(b"".join(self._records))
        times: list[int] = []
        for channel, index in self._index.items():
            at = index[::2]
            offsets = [before + offset for offset in index[1::2]]
            chunk.message_indices[channel] = _PackedIndex(channel, list(zip(at, offsets, strict=True)))
            figures.channel_message_counts[channel] += len(at)
            times += at
        first, last = min(times), max(times)
        chunk.message_start_time, chunk.message_end_time, chunk.num_messages = first, last, len(times)
        figures.message_start_time = min(first, figures.message_start_time) if figures.message_count else first
        figures.message_end_time = max(last, figures.message_end_time)
        figures.message_count += len(times)
        self._records, self._index, self.size = [], {}, 0


class _PackedIndex(MessageIndex):
    def write(self, stream: RecordBuilder) -> None:
        flat = [number for pair in self.records for number in pair]
        size = 8 * len(flat)
        stream.write(pack(f"<BQHI{len(flat)}Q", Opcode.MESSAGE_INDEX, size + 6, self.channel_id, size, *flat))


class PartWriter:
    """One MCAP file. Entries survive the death of the process once ``flush`` has returned."""

    def __init__(self, path: Path, origin: Origin, redaction: Redaction, at: int, part: int = 1) -> None:
        self.path, self._redaction = path, redaction
        self._file: IO[bytes] = path.open("xb", buffering=1 << 20)
        os.fchmod(self._file.fileno(), 0o600)
        self._writer: Any = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._chunk = OpenChunk(self._writer)
        self._writer.start(profile="", library=LIBRARY)
        self._writer.add_metadata("roboglot", {**origin.facts, "part": str(part)})
        for attachment in origin.attachments:
            self._writer.add_attachment(at, at, attachment.name, attachment.media_type, attachment.data)
        self._channels: dict[tuple[str, str], int] = {}
        self._schemas: dict[str, int] = {}
        self._sequence = 0
        self.first = at
        self.size = 0  # bytes so far, without the open chunk
        self.flush()

    def write(self, entry: Entry) -> None:
        """Add an entry."""
        self._sequence += 1
        self._add(entry, self._sequence)

    def repeat(self, entry: Entry) -> None:
        """Add an entry that an earlier part has, too; readers of both parts skip it."""
        self._add(entry, REPEATED)

    def _add(self, entry: Entry, sequence: int) -> None:
        channel = self._channels.get((entry.topic, entry.kind)) or self._channel(entry)
        data = encoded(entry, self._redaction)
        self._chunk.add(channel, entry.at, data, entry.wall, sequence)
        if self._chunk.size > CHUNK_BYTES:
            self._chunk.hand_over()
            self._writer.flush()

    def _channel(self, entry: Entry) -> int:
        kind = KINDS[entry.kind]
        if (schema := self._schemas.get(kind.schema)) is None:
            encoding = "protobuf" if kind.is_protobuf else "jsonschema"
            schema = self._schemas[kind.schema] = self._writer.register_schema(kind.schema, encoding, kind.schema_data)
        encoding = "protobuf" if kind.is_protobuf else "json"
        channel: int = self._writer.register_channel(entry.topic, encoding, schema)
        self._channels[entry.topic, entry.kind] = channel
        return channel

    def flush(self) -> None:
        """Close the chunk and hand everything to the system. Raises OSError."""
        self._chunk.hand_over()
        self._writer.flush()
        self.size = self._file.tell()

    def close(self) -> None:
        """Write the summary. Raises OSError."""
        try:
            self._chunk.hand_over()
            self._writer.finish()
        finally:
            self._file.close()


class Files:
    """The parts of one recording: ``PATH.mcap``, then ``PATH-002.mcap`` and so on; in a folder, names are generated.

    Each part begins with the standing values, so that it can be read without the parts before it.
    """

    def __init__(self, path: Path, origin: Origin, redaction: Redaction, limits: Limits) -> None:
        self._base = path.with_suffix("") if path.suffix == SUFFIX else path
        self._origin, self._redaction, self._limits = origin, redaction, limits
        self._part: PartWriter | None = None
        self._number = 0
        self._closed: list[tuple[Path, int]] = []
        self._standing = Standing()
        self.written = 0  # entries
        self.deleted = 0  # parts

    @property
    def path(self) -> Path:
        """Path of the current part, or of the first one before ``open``."""
        suffix = f"-{self._number:03}" if self._number > 1 else ""
        return self._base.with_name(f"{self._base.name}{suffix}{SUFFIX}")

    @property
    def size(self) -> int:
        """Size of all kept parts, bytes."""
        return sum(size for _, size in self._closed) + (self._part.size if self._part else 0)

    def open(self, at: int) -> None:
        """Create the first part, so that an unwritable path fails at once. Raises OSError."""
        self._next(at)

    def write(self, entry: Entry) -> None:
        """Add an entry; begin the next part if this one is full. Raises OSError."""
        part = self._part or self._next(entry.at)
        full = part.size > self._limits.part_bytes or entry.at - part.first > self._limits.part_seconds * NANO
        if full:
            part = self._next(entry.at)
        part.write(entry)
        self._standing.note(entry)
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
        for entry in self._standing.at(at):
            self._part.repeat(entry)
        return self._part
