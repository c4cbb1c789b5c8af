"""The rules of ``mcap doctor``, from the format's specification alone: what is wrong with a file, in words."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from dataclasses import dataclass, field

import zstandard

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(9, 16)


def records(data: bytes, start: int, end: int) -> list[tuple[int, int, bytes]]:
    """Position, opcode and content of each record."""
    found = []
    while start < end:
        opcode, length = struct.unpack_from("<BQ", data, start)
        found.append((start, opcode, data[start + 9 : start + 9 + length]))
        start += 9 + length
    assert start == end
    return found


@dataclass
class Doctor:
    """Looks at one file."""

    data: bytes
    wrong: list[str] = field(default_factory=list)
    schemas: set[int] = field(default_factory=set)
    channels: set[int] = field(default_factory=set)
    counts: Counter[int] = field(default_factory=Counter)  # messages by channel
    seen: Counter[int] = field(default_factory=Counter)  # records by opcode, also inside chunks
    places: dict[tuple[int, int], bytes] = field(default_factory=dict)  # of chunks, attachments, metadata

    def examine(self) -> list[str]:
        """Return what is wrong; empty: nothing."""
        data = self.data
        self.check(data.startswith(MAGIC) and data.endswith(MAGIC), "magic at both ends")
        footer = len(data) - len(MAGIC) - 9 - 20
        opcode, length, summary, offsets, crc = struct.unpack_from("<BQQQI", data, footer)
        self.check((opcode, length) == (FOOTER, 20), "the footer is last")
        self.check(crc == zlib.crc32(data[summary : footer + 9 + 16]), "CRC of the summary")
        body = records(data, len(MAGIC), summary)
        self.check(body[0][1] == HEADER, "the header is first")
        self.check(body[-1][1] == DATA_END, "the data's end comes before the summary")
        end = struct.unpack_from("<I", body[-1][2])[0]
        self.check(end in (0, zlib.crc32(data[: body[-1][0]])), "CRC of the data")
        chunk: dict[int, list[tuple[int, int]]] = {}
        for place, opcode, content in body:
            self.seen[opcode] += 1
            self.places[opcode, place] = content
            if opcode == CHUNK:
                chunk = self.open_chunk(content)
            elif opcode == MESSAGE_INDEX:
                self.check_index(content, chunk)
            else:
                self.define(opcode, content)
        self.check_summary(records(data, summary, offsets or footer))
        for _, opcode, content in records(data, offsets, footer) if offsets else []:
            group, start, size = struct.unpack_from("<BQQ", content)
            self.check(opcode == SUMMARY_OFFSET and summary <= start < offsets, "summary offsets point into it")
            self.check({op for _, op, _ in records(data, start, start + size)} == {group}, "groups of the summary")
        return self.wrong

    def check(self, good: bool, what: str) -> None:
        if not good:
            self.wrong.append(what)

    def define(self, opcode: int, content: bytes) -> None:
        """Schemas and channels come before what uses them."""
        if opcode == SCHEMA:
            number = struct.unpack_from("<H", content)[0]
            self.check(number > 0, "a schema's number is not zero")
            self.schemas.add(number)
        elif opcode == CHANNEL:
            number, schema = struct.unpack_from("<HH", content)
            self.check(schema == 0 or schema in self.schemas, f"schema {schema} is there before its channel")
            self.channels.add(number)
        elif opcode == MESSAGE:
            number = struct.unpack_from("<H", content)[0]
            self.check(number in self.channels, f"channel {number} is there before its message")
            self.counts[number] += 1

    def open_chunk(self, content: bytes) -> dict[int, list[tuple[int, int]]]:
        """Look at the messages of a chunk; return time and place of them by channel."""
        first, last, size, crc, named = struct.unpack_from("<QQQII", content)
        compression = content[32 : 32 + named].decode()
        (length,) = struct.unpack_from("<Q", content, 32 + named)
        inner = content[40 + named : 40 + named + length]
        self.check(compression == "zstd", "chunks are zstd")
        inner = zstandard.ZstdDecompressor().decompress(inner, max_output_size=size)
        self.check(len(inner) == size, "size of the chunk")
        self.check(crc in (0, zlib.crc32(inner)), "CRC of the chunk")
        found: dict[int, list[tuple[int, int]]] = {}
        for place, opcode, message in records(inner, 0, len(inner)):
            self.check(opcode in (SCHEMA, CHANNEL, MESSAGE), "what may be in a chunk")
            self.seen[opcode] += 1
            self.define(opcode, message)
            if opcode == MESSAGE:
                number, _, at = struct.unpack_from("<HIQ", message)
                self.check(first <= at <= last, "times of messages are in the chunk's")
                found.setdefault(number, []).append((at, place))
        return found

    def check_index(self, content: bytes, chunk: dict[int, list[tuple[int, int]]]) -> None:
        number, size = struct.unpack_from("<HI", content)
        rows = [struct.unpack_from("<QQ", content, 6 + 16 * n) for n in range(size // 16)]
        self.check(sorted(rows) == sorted(chunk.get(number, [])), "an index lists its channel's messages")

    def check_summary(self, summary: list[tuple[int, int, bytes]]) -> None:
        """Indexes and statistics say what is there."""
        by_kind: dict[int, list[bytes]] = {}
        for _, opcode, content in summary:
            by_kind.setdefault(opcode, []).append(content)
        for content in by_kind.get(CHUNK_INDEX, []):
            first, last, start, length = struct.unpack_from("<QQQQ", content)
            chunk = self.places.get((CHUNK, start), b"")
            self.check(len(chunk) + 9 == length, "a chunk's index points at it")
            self.check(chunk[:16] == struct.pack("<QQ", first, last), "times of a chunk's index")
        for index, kind in ((ATTACHMENT_INDEX, ATTACHMENT), (METADATA_INDEX, METADATA)):
            for content in by_kind.get(index, []):
                start, length = struct.unpack_from("<QQ", content)
                self.check(len(self.places.get((kind, start), b"")) + 9 == length, "an index points at its record")
            self.check(len(by_kind.get(index, [])) == self.seen[kind], "each has an index")
        self.check(len(by_kind.get(CHUNK_INDEX, [])) == self.seen[CHUNK], "each chunk has an index")
        (statistics,) = by_kind[STATISTICS]
        messages, schemas, channels, attachments, metadata, chunks = struct.unpack_from("<QHIIII", statistics)
        self.check(messages == self.counts.total() == self.seen[MESSAGE], "count of messages")
        self.check(schemas == len(self.schemas), "count of schemas")
        self.check(channels == len(self.channels), "count of channels")
        others = attachments, metadata, chunks
        self.check(others == (self.seen[ATTACHMENT], self.seen[METADATA], self.seen[CHUNK]), "counts of the rest")
