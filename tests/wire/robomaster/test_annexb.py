"""Cutting a video stream into pictures."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.wire.robomaster.annexb import ACCESS_UNIT_MAX, AccessUnitSplitter

LONG, SHORT = b"\x00\x00\x00\x01", b"\x00\x00\x01"
DELIMITER, SPS, PPS = LONG + b"\x09\xf0", LONG + b"\x67\x42\x00\x1f", LONG + b"\x68\xce\x3c"
KEY, DELTA = b"\x65\x88\x11\x22", b"\x41\x9a\x33\x44"
SECOND_SLICE = b"\x41\x40\x55\x66"  # begins at a later macroblock
UNITS = [
    DELIMITER + SPS + PPS + LONG + KEY,
    DELIMITER + LONG + DELTA + SHORT + SECOND_SLICE,
    LONG + DELTA,
    SPS + PPS + SHORT + KEY,
]


@given(st.lists(st.integers(1, 40), min_size=1, max_size=60))
def test_pictures_come_whole_however_the_bytes_arrive(sizes: list[int]) -> None:
    stream, splitter, got = b"".join(UNITS * 3) + DELIMITER + b"\x00", AccessUnitSplitter(), []
    while stream:
        for size in sizes:
            got += splitter.feed(stream[:size])
            stream = stream[size:]
    assert [unit.data for unit in got] == UNITS * 3
    assert [unit.keyframe for unit in got] == [True, False, False, True] * 3


@given(st.lists(st.binary(max_size=50), max_size=30))
def test_anything_else_is_kept_whole(parts: list[bytes]) -> None:
    splitter = AccessUnitSplitter()
    got = [unit.data for part in parts for unit in splitter.feed(part)]
    assert b"".join(parts).startswith(b"".join(got))


def test_stream_without_pictures_is_refused() -> None:
    splitter = AccessUnitSplitter()
    assert list(splitter.feed(b"\x00" * ACCESS_UNIT_MAX)) == []
    with pytest.raises(ValueError, match="a picture of more"):
        list(splitter.feed(b"\x00"))
