"""Composite maps to files and back: everything survives, unknown parts byte for byte; oversized ones are refused."""

from __future__ import annotations

import asyncio
import threading

import httpx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.model.components.mapping.annotations import (
    Annotations,
    Area,
    AreaKind,
    Line,
    LineKind,
)
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid, PointOfInterest
from roboglot.protocols.slamware.chapters.slam import composite, map_keeper
from roboglot.protocols.slamware.chapters.slam.composite import (
    FloorMap,
    FloorName,
    composite_of,
    floors_of,
)
from roboglot.wire.slamware.chapters.slam import stcm_layers
from roboglot.wire.slamware.chapters.slam.explore_map import BadMap
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, Layer, decode_stcm, encode_stcm
from roboglot.wire.slamware.chapters.slam.stcm_layers import LineEntry, PoseEntry

MULTI, POIS = "/api/multi-floor/map/v1", "/api/core/artifact/v1/pois"
SINGLE = st.floats(-1e4, 1e4, width=32)
TEXTS = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=8)
WORDS = st.dictionaries(TEXTS, TEXTS, max_size=3)
POINTS = st.builds(Point, SINGLE, SINGLE)
POSES = st.builds(Pose, SINGLE, SINGLE, st.floats(-3, 3, width=32))
NAMES = TEXTS.filter(lambda text: not text.startswith(":"))
MARKS = st.lists(st.builds(PointOfInterest, NAMES, POSES, WORDS), max_size=3, unique_by=lambda mark: mark.id)
LINES = st.lists(st.builds(Line, st.just(0), st.sampled_from(LineKind), POINTS, POINTS, metadata=WORDS), max_size=4)
WIDTHS = st.floats(0, 50, width=32)
AREAS = st.lists(st.builds(Area, st.just(0), st.just(AreaKind.DANGEROUS), POINTS, POINTS, WIDTHS), max_size=3)
CELLS = st.binary(min_size=12, max_size=12).map(
    lambda data: np.maximum(np.frombuffer(data, np.int8), -127).reshape(3, 4)
)
GRIDS = st.builds(OccupancyGrid, CELLS, st.just(0.05), POINTS)
# A vendor's kinds with an unknown payload, and unknown kinds.
USAGES = st.sampled_from(["rectangle_area", "landmark", "dbow", "marker", "pointsmap", "x"])
STRANGE = st.builds(
    lambda usage, pairs, payload: Layer((("usage", usage), ("type", "vnd.x/y"), *pairs.items()), payload),
    USAGES,
    st.dictionaries(TEXTS.map(lambda text: f"key {text}"), TEXTS, max_size=3),
    st.binary(max_size=40),
)


@settings(max_examples=60, deadline=None)
@given(GRIDS, LINES, AREAS, MARKS, MARKS, st.lists(STRANGE, max_size=3), TEXTS, TEXTS)
def test_a_floor_comes_back_from_its_file(
    grid: OccupancyGrid,
    lines: list[Line],
    areas: list[Area],
    places: list[PointOfInterest],
    docks: list[PointOfInterest],
    strange: list[Layer],
    building: str,
    storey: str,
) -> None:
    notes = Annotations(docks=tuple(docks)).with_new(*lines, *areas)
    floor = FloorMap(FloorName(building, storey, 3), grid, notes, tuple(places), tuple(strange))
    (read,) = floors_of(decode_stcm(encode_stcm(composite_of(floor))))
    assert (read.name, read.layers, read.places) == (floor.name, floor.layers, floor.places)
    assert read.grid is not None
    assert np.array_equal(read.grid.log_odds, grid.log_odds)
    assert read.grid.origin.distance_to(grid.origin) < 1e-4
    assert read.annotations.docks == tuple(docks)
    for kind in LineKind:
        assert [(e.start, e.end, e.metadata) for e in read.annotations.lines_of(kind)] == [
            (e.start, e.end, e.metadata) for e in notes.lines_of(kind)
        ]
    assert [(a.kind, a.start, a.end, a.half_width) for a in read.annotations.areas] == [
        (a.kind, a.start, a.end, a.half_width) for a in areas
    ]


def test_too_much_is_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = stcm_layers.line_layer(stcm_layers.WALLS, [LineEntry("1", 0, 0, 1, 0)] * 30)
    assert len(floors_of(CompositeMap((walls,)))[0].annotations.lines) == 30
    monkeypatch.setattr(composite, "DRAWN_MAX", 59)
    with pytest.raises(BadMap, match="59 places"):
        floors_of(CompositeMap((walls, walls)))
    monkeypatch.setattr(composite, "DRAWN_BYTES_MAX", len(walls.payload) - 1)
    with pytest.raises(BadMap, match="bytes"):
        floors_of(CompositeMap((walls,)))
    many = Annotations().with_new(*[Line(0, LineKind.WALL, Point(0, 0), Point(1, 0))] * 40)
    with pytest.raises(BadMap, match="bytes"):  # not written, either: it could not be loaded again
        composite_of(FloorMap(annotations=many))


def test_pairs_of_all_entries_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sixteen MB of empty pairs, a thousand to an entry, took eight seconds."""
    walls = stcm_layers.line_layer(stcm_layers.WALLS, [LineEntry("1", 0, 0, 1, 0, (("", ""),) * 10)] * 3)
    docks = stcm_layers.pose_layer(stcm_layers.DOCKS, [PoseEntry("1", 0, 0, 0, (("", ""),) * 10)])
    monkeypatch.setattr(stcm_layers, "PAIRS_MAX", 40)
    assert len(floors_of(CompositeMap((walls, docks)))[0].annotations.lines) == 3
    monkeypatch.setattr(stcm_layers, "PAIRS_MAX", 39)
    with pytest.raises(BadMap, match="39 pairs"):
        floors_of(CompositeMap((walls, docks)))
    line = Line(0, LineKind.WALL, Point(0, 0), Point(1, 0), metadata={str(n): "" for n in range(40)})
    with pytest.raises(BadMap, match="39 pairs"):  # not written, either
        composite_of(FloorMap(annotations=Annotations().with_new(line)))


def test_layers_beyond_the_limit_are_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thirty layers of 20,000 lines took six seconds before they were counted."""
    read: list[Layer] = []

    def read_lines(layer: Layer, _usage: str, _budget: stcm_layers.Budget) -> list[LineEntry]:
        read.append(layer)
        return [LineEntry("1", 0.0, 0.0, 1.0, 1.0)]

    monkeypatch.setattr(stcm_layers, "read_lines", read_lines)
    monkeypatch.setattr(composite, "DRAWN_MAX", 2)
    with pytest.raises(BadMap, match="more than 2 "):
        floors_of(CompositeMap((stcm_layers.line_layer(stcm_layers.WALLS, []),) * 9))
    assert len(read) == 3


async def test_no_one_waits_while_large_file_is_read(
    bare_client: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = threading.Event()
    monkeypatch.setattr(map_keeper, "LockstepClock", ())  # any other clock includes other threads' time
    read = FloorMap(grid=OccupancyGrid(np.zeros((1, 1), np.int8), 0.05, Point()))
    monkeypatch.setattr(map_keeper, "_parsed", lambda _: done.wait(20) and [read])
    upload = asyncio.create_task(bare_client.post(f"{MULTI}/stcm", content=b"STCM"))
    try:
        for _ in range(5):
            assert (await bare_client.get(POIS)).status_code == 200
        assert not upload.done()
    finally:
        done.set()
    assert (await upload).status_code == 200
