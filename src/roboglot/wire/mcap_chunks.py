"""Unpacks chunks of MCAP files that anyone may have written.

The mcap library believes the size in a compressed frame's own head: 130 kB become 4 GB. Here a chunk unpacks to the
bytes that it claims, and a file to a bounded multiple of its own.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from io import BytesIO
from typing import IO
from zlib import crc32

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader
from zstandard import ZstdDecompressor

from roboglot.wire.mcap_damage import RECORD_MAX

UNPACKED_MAX = 256 << 20  # bytes of a chunk
RECORDS_MAX = 1_000_000  # of a chunk
FILE_UNPACKED = 1 << 30  # bytes of all chunks of a small file
FILE_RATIO = 200  # times its size, of a larger one


class Bomb(McapError):
    """A file with far more in it than its size lets expect."""


class Allowance:
    """Bytes that the chunks of one file may still unpack to."""

    def __init__(self, file: IO[bytes]) -> None:
        self._left = max(FILE_UNPACKED, FILE_RATIO * os.fstat(file.fileno()).st_size)

    def take(self, chunk: Chunk) -> None:
        """Count a chunk. Raises Bomb."""
        self._left -= chunk.uncompressed_size
        if self._left < 0:
            raise Bomb(f"its chunks unpack to more than {FILE_UNPACKED} bytes, and to more than {FILE_RATIO} times it")


def stream_of(file: IO[bytes]) -> Iterator[McapRecord]:
    """Yield the records of a file, its chunks unpacked. Raises an error of ``mcap_damage``."""
    allowance = Allowance(file)
    for record in StreamReader(file, emit_chunks=True, record_size_limit=RECORD_MAX).records:
        if isinstance(record, Chunk):
            allowance.take(record)
            yield from records_in(record)
        else:
            yield record


def records_in(chunk: Chunk) -> list[McapRecord]:
    """Return the records of a chunk. Raises an error of ``mcap_damage``."""
    data = _unpacked(chunk)
    if len(data) != chunk.uncompressed_size:
        raise McapError(f"a chunk does not unpack to its {chunk.uncompressed_size} bytes")
    if chunk.uncompressed_crc and crc32(data) != chunk.uncompressed_crc:
        raise McapError("a chunk has another checksum")
    stream, found = ReadDataStream(BytesIO(data)), list[McapRecord]()
    while stream.count < len(data):
        code, length = stream.read1(), stream.read8()
        if length > len(data) - stream.count:
            raise McapError(f"a record of {length} bytes is longer than its chunk")
        match code:
            case Opcode.CHANNEL:
                found.append(Channel.read(stream))
            case Opcode.MESSAGE:
                found.append(Message.read(stream, length))
            case Opcode.SCHEMA:
                found.append(Schema.read(stream))
            case _:
                stream.read(length)
        if len(found) > RECORDS_MAX:
            raise McapError(f"a chunk of more than {RECORDS_MAX} records")
    return found


def _unpacked(chunk: Chunk) -> bytes:
    """Return the bytes of a chunk, at most one more than it claims."""
    most = chunk.uncompressed_size + 1
    if most > UNPACKED_MAX:
        raise McapError(f"a chunk of more than {UNPACKED_MAX} bytes")
    match chunk.compression:
        case "":
            return chunk.data
        case "zstd":
            return ZstdDecompressor(max_window_size=UNPACKED_MAX).stream_reader(BytesIO(chunk.data)).read(most)
        case "lz4":
            from lz4.frame import LZ4FrameDecompressor

            try:
                return bytes(LZ4FrameDecompressor().decompress(chunk.data, max_length=most))
            except RuntimeError as error:  # of lz4, for all kinds of damage
                raise McapError(str(error)) from None
    raise McapError(f"unknown compression {chunk.compression[:40]!r}")
