"""Composite maps: what goes in comes out, and what no one understands is kept byte for byte."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.wire.slamware.chapters.slam import stcm, stcm_layers
from roboglot.wire.slamware.chapters.slam.explore_map import BadMap, ExploreMap
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, Layer, decode_stcm, encode_stcm
from roboglot.wire.slamware.chapters.slam.stcm_layers import AreaEntry, Budget, LineEntry, PoseEntry

TEXTS = st.binary(max_size=20).map(lambda data: data.decode("utf-8", "surrogateescape"))
PAIRS = st.lists(st.tuples(TEXTS, TEXTS), max_size=4).map(tuple)
LAYERS = st.builds(Layer, PAIRS, st.binary(max_size=60))
SHORTS = st.integers(0, 0xFFFF)
MAPS = st.builds(
    CompositeMap, st.lists(LAYERS, max_size=4).map(tuple), st.tuples(*[SHORTS] * 4), PAIRS, st.binary(max_size=8)
)
SINGLE = st.floats(-1e5, 1e5, width=32)


@given(MAPS)
def test_every_map_comes_back_with_every_byte(composite: CompositeMap) -> None:
    data = encode_stcm(composite)
    assert decode_stcm(data) == composite
    assert encode_stcm(decode_stcm(data)) == data


@given(st.binary(max_size=200))
def test_anything_else_is_a_map_or_refused(data: bytes) -> None:
    for candidate in (data, b"STCM" + data, b"STCM" + struct.pack("<4HI", 18, 1, 1, 1, 2) + b"\0\0" + data):
        try:
            composite = decode_stcm(candidate)
        except BadMap:
            continue
        assert len(encode_stcm(composite)) <= len(candidate) + 4 * len(composite.layers)


def test_the_bytes_are_those_of_the_field() -> None:
    data = encode_stcm(CompositeMap((Layer((("name", "x"),), b"abc"),)))
    assert data == (
        b"STCM" + bytes.fromhex("1200 0100 0100 0100") + bytes.fromhex("01000000 0000")  # one layer, no pairs
        + bytes.fromhex("12000000 0100 0400") + b"name" + bytes.fromhex("0100") + b"x" + b"abc"
    )  # fmt: skip


def test_sizes_that_exclude_themselves_are_read_too() -> None:
    layers = (Layer((("name", "x"),), b"abc"), Layer((("name", "y"),), b""))
    data = encode_stcm(CompositeMap(layers))
    first = 18
    size = struct.unpack_from("<I", data, first)[0]
    exclusive = bytearray(data)
    struct.pack_into("<I", exclusive, first, size - 4)
    struct.pack_into("<I", exclusive, first + size, struct.unpack_from("<I", data, first + size)[0] - 4)
    assert decode_stcm(bytes(exclusive)).layers == layers


def test_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BadMap, match="layers"):
        decode_stcm(b"STCM" + struct.pack("<4HIH", 18, 1, 1, 1, 0xFFFFFFFF, 0))
    with pytest.raises(BadMap, match="pairs"):
        decode_stcm(b"STCM" + struct.pack("<4HIH", 18, 1, 1, 1, 0, 0xFFFF))
    monkeypatch.setattr(stcm, "MAP_BYTES_MAX", 20)
    with pytest.raises(BadMap, match="20 bytes"):
        decode_stcm(b"STCM" + bytes(20))
    with pytest.raises(BadMap, match="20 bytes"):
        encode_stcm(CompositeMap(tail=bytes(20)))


def test_grids() -> None:
    cells = np.array([[0, 127, -127], [1, -1, 5]], np.int8)
    layer = stcm_layers.grid_layer(ExploreMap(-1.25, 2.05, 0.05, cells), (("floor", "1F"),))
    assert layer.metadata["dimension_width"] == "3"
    assert layer.metadata["floor"] == "1F"
    again = stcm_layers.read_grid(layer)
    assert again is not None
    assert (again.x, again.y, again.resolution) == (-1.25, 2.05, 0.05)
    assert (again.cells == cells).all()
    assert stcm_layers.read_grid(Layer((("usage", "sweep"), ("type", stcm_layers.GRID)))) is None
    assert stcm_layers.read_grid(Layer((*layer.pairs, ("compression", "rle")), layer.payload)) is None
    for broken, words in (
        (Layer(layer.pairs, layer.payload[:-1]), "3 x 2 cells do not make 5"),
        (Layer((*layer.pairs, ("dimension_width", "0"), ("dimension_height", "9" * 12))), "cells do not make 0"),
        (Layer((*layer.pairs, ("dimension_width", "9" * 50), ("dimension_height", "0"))), "cells do not make 0"),
        (Layer((*layer.pairs, ("origin_x", "nan")), layer.payload), "no map has its corner"),
        (Layer((*layer.pairs, ("origin_x", "")), layer.payload), "the grid's origin_x is missing or no number"),
        (Layer((*layer.pairs, ("resolution_x", "0")), layer.payload), "cells of 0.0 x"),
        (Layer((*layer.pairs, ("dimension_width", "two")), layer.payload), "dimension_width is missing or no whole"),
    ):
        with pytest.raises(BadMap, match=words):
            stcm_layers.read_grid(broken)


@given(st.lists(st.builds(LineEntry, TEXTS, SINGLE, SINGLE, SINGLE, SINGLE, PAIRS), max_size=4))
def test_lines(lines: list[LineEntry]) -> None:
    layer = stcm_layers.line_layer(stcm_layers.WALLS, lines)
    assert stcm_layers.read_lines(layer, stcm_layers.WALLS, Budget()) == lines
    assert stcm_layers.read_lines(layer, stcm_layers.TRACKS, Budget()) is None


@given(st.lists(st.builds(PoseEntry, TEXTS, SINGLE, SINGLE, SINGLE, PAIRS, st.integers(0, 255)), max_size=4))
def test_poses(poses: list[PoseEntry]) -> None:
    layer = stcm_layers.pose_layer(stcm_layers.DOCKS, poses)
    assert stcm_layers.read_poses(layer, stcm_layers.DOCKS, Budget()) == poses


@given(st.binary(max_size=60))
def test_entries_written_in_another_way_are_not_understood(payload: bytes) -> None:
    for usage, kind, read in (
        (stcm_layers.WALLS, stcm_layers.LINES, stcm_layers.read_lines),
        (stcm_layers.PLACES, stcm_layers.POSES, stcm_layers.read_poses),
    ):
        entries = read(Layer((("usage", usage), ("type", kind)), payload), usage, Budget())
        assert entries is None or payload == b"" or entries


def test_areas_are_ours_and_vendors_are_left_alone() -> None:
    area = AreaEntry(3, "forbidden_area", 0.1, 0.2, 0.3, 0.4, 0.5, {"escape_distance": "0.4"})
    layer = stcm_layers.area_layer([area])
    assert stcm_layers.read_areas(layer) == [area]
    vendors = Layer(
        (("usage", "rectangle_area"), ("type", "vnd.slamtec.map-layer/vnd.rectangle-area-map+binary")), b"?"
    )
    assert stcm_layers.read_areas(vendors) is None
    assert stcm_layers.read_areas(Layer(layer.pairs, b"[{}]")) is None
