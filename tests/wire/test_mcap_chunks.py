"""Chunks of hostile MCAP files: what they unpack to is bounded before it is in memory."""

import struct
import tracemalloc
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk, Message

from roboglot.recording.message_index import MessageIndex
from roboglot.recording.reader import BadRecording, read_recording
from roboglot.wire import mcap_chunks
from roboglot.wire.mcap_chunks import records_in

MAGIC = b"\x89MCAP0\r\n"
PACK = {"": bytes, "zstd": zstandard.compress, "lz4": lz4.frame.compress}
MESSAGE = struct.pack("<BQHIQQ", Opcode.MESSAGE, 23, 1, 0, 5, 5) + b"x"


def chunk(body: bytes, packing: str, size: int) -> Chunk:
    return Chunk(packing, PACK[packing](body), 5, 5, 0, size)


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def record(code: int, *parts: bytes) -> bytes:
    return struct.pack("<BQ", code, sum(map(len, parts))) + b"".join(parts)


def file_of(path: Path, *chunks: Chunk) -> Path:
    heads = (
        record(
            Opcode.CHUNK, struct.pack("<QQQI", 5, 5, c.uncompressed_size, 0), text(c.compression),
            struct.pack("<Q", len(c.data)), c.data,
        )
        for c in chunks
    )  # fmt: skip
    path.write_bytes(MAGIC + record(Opcode.HEADER, text(""), text("x")) + b"".join(heads))
    return path


@pytest.mark.parametrize("packing", PACK)
def test_sound_chunks_are_unpacked(packing: str) -> None:
    found = records_in(chunk(2 * MESSAGE, packing, 2 * len(MESSAGE)))
    assert [(one.log_time, one.data) for one in found if isinstance(one, Message)] == [(5, b"x")] * 2


@pytest.mark.parametrize("packing", ["zstd", "lz4"])
@pytest.mark.parametrize("claimed", [1000, 1 << 40])
def test_bombs_take_no_memory(packing: str, claimed: int) -> None:
    bomb = chunk(bytes(64 << 20), packing, claimed)
    tracemalloc.start()
    with pytest.raises(McapError):
        records_in(bomb)
    assert tracemalloc.get_traced_memory()[1] < 4 << 20
    tracemalloc.stop()


@pytest.mark.parametrize(
    "bad",
    [
        Chunk("zip", b"x", 5, 5, 0, 1),
        Chunk("lz4", b"no frame", 5, 5, 0, 8),
        Chunk("", MESSAGE, 5, 5, 1, len(MESSAGE)),
        Chunk("", struct.pack("<BQ", Opcode.MESSAGE, 1 << 60), 5, 5, 0, 9),
    ],
)
def test_unsound_chunks_are_damage(bad: Chunk) -> None:
    with pytest.raises(McapError):
        records_in(bad)


def test_swarms_of_records_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_chunks, "RECORDS_MAX", 9)
    with pytest.raises(McapError, match="records"):
        records_in(chunk(10 * MESSAGE, "zstd", 10 * len(MESSAGE)))


@pytest.mark.parametrize("read", [read_recording, MessageIndex])
def test_files_unpack_to_a_bounded_multiple(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, read: type) -> None:
    monkeypatch.setattr(mcap_chunks, "FILE_UNPACKED", 1 << 20)
    body = record(99, bytes(1 << 20))
    with pytest.raises(BadRecording, match="more than 200 times it"):
        read(file_of(tmp_path / "bomb.mcap", *[chunk(body, "zstd", len(body))] * 2))
