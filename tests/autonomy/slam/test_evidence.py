"""The growing arrays behind the map, the scans that fill them, and routes as the follower sees them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.autonomy.navigation.route import SPACING, Route
from roboglot.autonomy.navigation.rules import GridFrame, Mask
from roboglot.autonomy.slam.evidence import CELLS_MAX, GRID_MAX, RESOLUTION, EvidenceGrid
from roboglot.autonomy.slam.painting import paint
from roboglot.autonomy.slam.scan_points import RAYS_MAX, ScanPoints, ScanReader
from roboglot.kernels.occupancy import HIT, SCANS
from roboglot.model.components.mapping.annotations import Area, AreaKind
from roboglot.model.geometry import Point, Pose
from roboglot.model.sensing import LaserScan

places = st.floats(-300.0, 300.0)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(places, places, places, places), min_size=1, max_size=4))
def test_growing_keeps_cells_in_place_and_stays_bounded(rectangles: list[tuple[float, ...]]) -> None:
    grid = EvidenceGrid()
    first = rectangles[0]
    grid.make_room(first[0], first[1], first[0], first[1])
    row = math.floor(first[1] / RESOLUTION) - grid.first_row
    column = math.floor(first[0] / RESOLUTION) - grid.first_column
    grid.evidence[row, column] = 77
    grid.make_surfaces(1)
    grid.slots[row, column], grid.surfaces[1], grid.used = 1, 5.0, 2
    for x0, y0, x1, y1 in rectangles:
        grid.make_room(min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1))
        assert max(grid.evidence.shape) <= GRID_MAX
        grid.make_surfaces(3)
        assert grid.evidence.shape == grid.marks.shape == grid.slots.shape
        row = math.floor(first[1] / RESOLUTION) - grid.first_row
        column = math.floor(first[0] / RESOLUTION) - grid.first_column
        assert grid.evidence[row, column] == 77
        assert grid.surfaces[grid.slots[row, column]].tolist() == [5.0] * 5
        assert np.count_nonzero(grid.evidence) == 1


def test_grid_holds_what_it_was_asked_to_hold() -> None:
    grid = EvidenceGrid()
    grid.make_room(-3.0, -2.0, 4.0, 5.0)
    grid.make_room(-3.0, -2.0, 30.0, 5.0)
    height, width = grid.evidence.shape
    assert grid.corner.x <= -3.0
    assert grid.corner.y <= -2.0
    assert grid.corner.x + width * RESOLUTION >= 30.0
    assert grid.corner.y + height * RESOLUTION >= 5.0


def test_drawn_map_keeps_signs_and_known_cells_known() -> None:
    grid = EvidenceGrid()
    grid.make_room(0.0, 0.0, 1.0, 1.0)
    row, column = 3 - grid.first_row, 2 - grid.first_column
    grid.evidence[row, column : column + 4] = (1, -1, 1000, -1000)
    grid.scans = 1
    drawn = grid.occupancy()
    assert drawn.log_odds.shape == (1, 4)
    assert drawn.log_odds[0, 0] > 0 > drawn.log_odds[0, 1]
    assert drawn.log_odds[0, 2] > 100
    assert drawn.log_odds[0, 3] < -100
    assert (drawn.origin.x, drawn.origin.y) == pytest.approx((2 * RESOLUTION, 3 * RESOLUTION))
    assert EvidenceGrid().occupancy().log_odds.shape == (0, 0)


def scan_of(ranges: list[float], mount: Pose = Pose()) -> LaserScan:  # noqa: B008 - a value
    return LaserScan(0.0, np.array(ranges, np.float32), 0.0, math.tau / len(ranges), 0.1, 10.0, mount)


def test_points_of_a_scan_know_the_mount() -> None:
    points = ScanReader().read(scan_of([1.0, 2.0, math.inf, 1.0], Pose(0.5, 0.0, math.pi / 2)))
    np.testing.assert_allclose(points.points, [[0.5, 1.0], [-1.5, 0.0], [1.5, 0.0]], atol=1e-9)
    np.testing.assert_allclose(points.ends[2], [0.5, -4.0], atol=1e-9)
    assert list(points.hit) == [1, 1, 0, 1]


def test_a_blind_lidar_says_nothing() -> None:
    reader = ScanReader()
    for ranges in ([math.inf] * 100, [math.nan] * 100, [0.01] * 100, [-5.0] * 100, []):
        points = reader.read(scan_of(ranges) if ranges else LaserScan(0.0, np.empty(0, np.float32), 0, 0, 0.1, 10.0))
        assert len(points.ends) == len(points.points) == 0


def test_nonsense_among_the_ranges_is_left_out() -> None:
    points = ScanReader().read(scan_of([1.0, math.nan, 0.01, -1.0, math.inf, 2.0]))
    assert len(points.points) == 2
    assert len(points.ends) == 3
    assert len(ScanReader().read(scan_of([1.0] * (RAYS_MAX + 10))).points) == RAYS_MAX


def test_kernel_reads_scans_to_the_last_bit() -> None:
    random, (plain, compiled) = np.random.default_rng(3), (ScanReader(), ScanReader())
    compiled.load_kernel()
    for share in (0.0, 0.05, 0.2, 0.95):
        ranges = random.uniform(0.0, 12.0, 360).astype(np.float32)
        for nonsense in (math.nan, math.inf, 0.01):
            ranges[random.random(360) < share] = nonsense
        scan = scan_of(ranges.tolist(), Pose(0.1, -0.2, 0.3))
        one, other = plain.read(scan), compiled.read(scan)
        for a, b in ((one.ends, other.ends), (one.hit, other.hit), (one.points, other.points)):
            assert a.shape == b.shape
            assert a.tobytes() == b.tobytes()
            assert a.dtype == b.dtype
        assert one.sensor == other.sensor


def route_through(*legs: list[tuple[float, float]]) -> Route:
    route = Route([np.array(leg) for leg in legs])
    route.set_speeds(np.full(len(route.points), 1.0), 2.0)
    return route


def test_route_brakes_for_its_end_and_for_bends() -> None:
    route = route_through([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0)])
    assert route.length == pytest.approx(8.0)
    speeds = dict(zip(np.round(route.along, 2).tolist(), route.speeds.tolist(), strict=True))
    assert speeds[2.0] == 1.0
    assert speeds[4.0] < 0.5
    assert speeds[8.0] == 0.0
    steepest = np.diff(route.speeds**2) / (2 * np.diff(route.along))
    assert steepest.min() >= -2.0


def test_route_knows_its_goals_and_what_is_left() -> None:
    route = route_through([(0.0, 0.0), (1.0, 0.0)], [(1.0, 2.0)])
    assert route.goals_along == pytest.approx([1.0, 3.0])
    along, beside = route.advance(Pose(0.5, 0.1), 0)
    assert (along, beside) == (pytest.approx(0.5, abs=SPACING), pytest.approx(0.1, abs=SPACING))
    assert route.remaining(Pose(0.5, 0.1), along).length == pytest.approx(2.5, abs=0.1)
    assert route.advance(Pose(0.0, 0.0), 0)[0] >= along  # never back


def test_a_route_of_one_place_ends_there() -> None:
    route = route_through([(1.0, 2.0), (1.0, 2.0)])
    assert route.length == 0.0
    assert route.advance(Pose(1.2, 2.0), 0) == (0.0, pytest.approx(0.2))


def test_a_full_map_says_so_once(caplog: pytest.LogCaptureFixture) -> None:
    grid = EvidenceGrid()
    grid.make_room(0.0, 0.0, 330.0, 1.0)
    assert not grid.full
    assert grid.evidence.shape[1] * RESOLUTION > 330.0
    for _ in range(2):
        grid.make_room(0.0, 0.0, 420.0, 1.0)
    assert grid.full
    assert len(caplog.records) == 1
    assert "map has its largest size, 400 x " in caplog.text


def test_wide_map_is_bounded_and_keeps_its_cells() -> None:
    grid = EvidenceGrid()
    grid.make_room(0.0, 0.0, 150.0, 100.0)
    assert not grid.full
    grid.evidence[:] = 7
    known = grid.evidence.size
    grid.make_room(0.0, 0.0, 390.0, 390.0)
    assert grid.full
    assert grid.evidence.size <= CELLS_MAX
    assert int((grid.evidence == 7).sum()) == known


def test_every_scan_counts_however_many_there_were() -> None:
    grid, echo = EvidenceGrid(), np.array([[2.0, 0.0]])
    scan = ScanPoints(echo, np.ones(1, np.uint8), echo, Point())
    paint(grid, scan, Pose(), fill=False)
    row, column = -grid.first_row, math.floor(2.0 / RESOLUTION) - grid.first_column
    for grid.scans in (*range(SCANS - 3, SCANS + 3), 2 * SCANS - 1):
        grid.evidence[row, column] = 10
        paint(grid, scan, Pose(), fill=False)
        assert grid.evidence[row, column] == 10 + HIT


def test_cells_outside_maintained_areas_are_protected(monkeypatch: pytest.MonkeyPatch) -> None:
    """Until those areas are gone, also after the map's origin has moved, and marked once for each change of them."""
    looked = list[Area]()
    inside = GridFrame.inside

    def noted(frame: GridFrame, area: Area) -> Mask:
        looked.append(area)
        return inside(frame, area)

    monkeypatch.setattr(GridFrame, "inside", noted)
    grid, echo = EvidenceGrid(), np.array([[2.0, 0.0]])
    scan = ScanPoints(echo, np.ones(1, np.uint8), echo, Point())
    elsewhere = Area(1, AreaKind.MAINTENANCE, Point(1.0, 2.0), Point(2.0, 2.0), 0.5)

    def wall() -> int:
        return int(grid.evidence[-grid.first_row, math.floor(2.0 / RESOLUTION) - grid.first_column])

    paint(grid, scan, Pose(), fill=False)
    for _ in range(3):
        paint(grid, scan, Pose(), fill=False, maintained=(elsewhere,))
    assert (wall(), len(looked)) == (HIT, 1)
    paint(
        grid,
        ScanPoints(echo * 10, np.ones(1, np.uint8), echo * 10, Point()),
        Pose(),
        fill=False,
        maintained=(elsewhere,),
    )
    paint(grid, scan, Pose(), fill=False, maintained=(elsewhere,))
    assert (wall(), len(looked)) == (HIT, 2)  # it has grown
    paint(grid.copy(), scan, Pose(), fill=False, maintained=(elsewhere,))
    assert len(looked) == 2
    moved = grid.seen_from(20, 0)
    paint(moved, scan, Pose(-1.0, 0.0), fill=False)
    assert wall() == 2 * HIT
