"""The binary explore map: layout, sign, and a decoder that survives anything."""

import contextlib
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from roboglot.wire.slamware.chapters.slam.explore_map import (
    HEADER,
    BadMap,
    ExploreMap,
    decode_explore_map,
    encode_explore_map,
)

MAP = ExploreMap(-1.5, 2.25, 0.05, np.array([[0, 127, 1], [-1, -127, 0]], np.int8))


def test_the_layout_byte_by_byte() -> None:
    data = encode_explore_map(MAP)
    assert len(data) == 36 + 6
    assert data[:8] == struct.pack("<ff", -1.5, 2.25)
    assert data[8:16] == struct.pack("<II", 3, 2)  # along x, then along y
    assert data[16:20] == struct.pack("<f", 0.05)
    assert data[20:32] == bytes(12)
    assert data[32:36] == struct.pack("<I", 6)
    assert data[36:] == bytes([0, 127, 1, 255, 129, 0])  # free up to 127, occupied from 128


@given(arrays(np.int8, array_shapes(min_dims=2, max_dims=2, min_side=0, max_side=20)))
def test_encoded_maps_are_decoded_unchanged(cells: np.ndarray) -> None:
    back = decode_explore_map(encode_explore_map(ExploreMap(1.0, -2.0, 0.25, cells)))
    assert (back.x, back.y, back.resolution) == (1.0, -2.0, 0.25)
    assert np.array_equal(back.cells, cells)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        bytes(35),
        encode_explore_map(MAP)[:-1],
        encode_explore_map(MAP) + b"\0",
        HEADER.pack(0, 0, 2, 2, 0.05, 5) + bytes(5),
        HEADER.pack(0, 0, 2, 2, 0.0, 4) + bytes(4),
        HEADER.pack(0, 0, 2, 2, float("nan"), 4) + bytes(4),
        HEADER.pack(float("inf"), 0, 2, 2, 0.05, 4) + bytes(4),
        HEADER.pack(0, 0, 1 << 31, 1 << 31, 0.05, 0),
        HEADER.pack(0, 0, 0, (1 << 32) - 1, 0.05, 0),
    ],
)
def test_bytes_that_are_no_map_are_refused(data: bytes) -> None:
    with pytest.raises(BadMap):
        decode_explore_map(data)


@given(st.binary(max_size=80))
def test_any_bytes_are_a_map_or_refused(data: bytes) -> None:
    try:
        decoded = decode_explore_map(data)
    except BadMap:
        return
    assert decoded.cells.size == len(data) - 36


@given(st.data())
def test_a_bent_header_never_breaks_the_decoder(data: st.DataObject) -> None:
    bent = bytearray(encode_explore_map(MAP))
    for _ in range(data.draw(st.integers(1, 4))):
        bent[data.draw(st.integers(0, 35))] = data.draw(st.integers(0, 255))
    with contextlib.suppress(BadMap):
        decode_explore_map(bytes(bent))
