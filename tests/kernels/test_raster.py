"""The rasteriser: which polygon is seen where, against geometry done by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from roboglot.kernels.lanes import MARGIN
from roboglot.kernels.layouts import COEFFICIENTS, FIRST
from roboglot.kernels.raster import CORNERS_MAX, fill, project

WIDTH, HEIGHT = 320, 200
FOCAL = WIDTH / 2 / math.tan(math.radians(35))
AHEAD_X = np.array(((0.0, -1.0, 0.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)))  # looking along world x, z up


def wall(x, y0, y1, z0, z1):
    """A rectangle across x that is seen from smaller x."""
    return [(x, y1, z0), (x, y0, z0), (x, y0, z1), (x, y1, z1)]


def picture(*quads, eye=(0.0, 0.0, 0.0), visible=None, planes_max=50, band=HEIGHT):
    corners = np.array(quads, dtype=np.float64).reshape(-1, 4, 3)
    mappings = np.zeros((len(corners), 3, 3))
    mappings[:, 0] = corners[:, 0]
    mappings[:, 1], mappings[:, 2] = (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)
    numbers = FIRST + planes_max
    planes, sources = np.zeros((numbers, COEFFICIENTS)), np.zeros(numbers, np.int32)
    outlines, spans = np.zeros((numbers, CORNERS_MAX, 2)), np.zeros((numbers, 3), np.int32)
    rooms = np.arange(len(corners), dtype=np.int32)
    visible = np.ones(len(corners), np.uint8) if visible is None else np.array(visible, np.uint8)
    lens = np.array((FOCAL, WIDTH / 2, HEIGHT / 2))
    drawn = project(
        corners, mappings, rooms, visible, AHEAD_X, np.array(eye), lens, planes, sources, outlines, spans, FIRST
    )
    depth, seen = np.empty((HEIGHT, WIDTH), np.float32), np.empty((HEIGHT, WIDTH), np.uint16)
    for top in range(0, HEIGHT, band):
        rows = min(band, HEIGHT - top)
        some, numbered = np.full((band, WIDTH + MARGIN), 9.0, np.float32), np.full((band, WIDTH + MARGIN), 9, np.uint16)
        fill(outlines, spans, planes, FIRST + drawn, top, rows, np.empty((band, 2)), some, numbered)
        depth[top : top + rows], seen[top : top + rows] = some[:rows, :WIDTH], numbered[:rows, :WIDTH]
    return seen, depth, planes, sources, drawn


def extent(mask):
    """First and last column and row of what is set."""
    rows, columns = np.nonzero(mask)
    return columns.min(), columns.max(), rows.min(), rows.max()


def test_a_wall_covers_the_pixels_that_geometry_says():
    seen, depth, *_ = picture(wall(2.0, -0.5, 0.3, -0.4, 0.2))
    left, right = WIDTH / 2 - FOCAL * 0.3 / 2, WIDTH / 2 + FOCAL * 0.5 / 2
    top, bottom = HEIGHT / 2 - FOCAL * 0.2 / 2, HEIGHT / 2 + FOCAL * 0.4 / 2
    inside = seen == FIRST
    assert extent(inside) == (
        math.ceil(left - 0.5),
        math.ceil(right - 0.5) - 1,
        math.ceil(top - 0.5),
        math.ceil(bottom - 0.5) - 1,
    )
    assert inside.sum() == (math.ceil(right - 0.5) - math.ceil(left - 0.5)) * (
        math.ceil(bottom - 0.5) - math.ceil(top - 0.5)
    )
    assert depth[inside] == pytest.approx(0.5)


def test_nearer_things_hide_farther_ones_in_any_order():
    near, far = wall(1.0, -0.2, 0.2, -0.2, 0.2), wall(3.0, -1.0, 1.0, -1.0, 1.0)
    for order in ((near, far), (far, near)):
        seen, _, _, sources, _ = picture(*order)
        number = seen[HEIGHT // 2, WIDTH // 2]
        assert order[sources[number]] is near
        number = seen[HEIGHT // 2, WIDTH // 2 + int(FOCAL * 0.3)]
        assert order[sources[number]] is far


def test_neighbours_leave_no_gap_and_do_not_overlap():
    seen, _, _, _, drawn = picture(wall(2.0, -0.5, 0.123, -0.3, 0.3), wall(2.0, 0.123, 0.5, -0.3, 0.3))
    together = picture(wall(2.0, -0.5, 0.5, -0.3, 0.3))[0]
    assert drawn == 2
    assert ((seen > 0) == (together > 0)).all()


@pytest.mark.parametrize(
    "quad",
    [
        pytest.param(wall(-2.0, -1, 1, -1, 1), id="behind the eye"),
        pytest.param(list(reversed(wall(2.0, -1, 1, -1, 1))), id="seen from its back"),
        pytest.param(wall(2.0, 5, 6, -1, 1), id="beside the picture"),
        pytest.param([(1, 0, 0), (3, 0, 0), (3, 0, 1), (1, 0, 1)], id="edge on"),
    ],
)
def test_is_not_drawn(quad):
    seen, _, _, _, drawn = picture(quad)
    assert drawn == 0
    assert not seen.any()


def test_surfaces_are_clipped_at_the_eye():
    """A wall along the way, to the left, from 5 m behind to 5 m ahead."""
    seen, depth, *_ = picture([(-5, 1, -1), (5, 1, -1), (5, 1, 1), (-5, 1, 1)])
    assert (seen[:, 0] == FIRST).all()
    assert not seen[:, WIDTH // 2 :].any()
    slant = (WIDTH / 2 - 0.5) / FOCAL  # y/x of the first column's middle
    assert 1 / depth[HEIGHT // 2, 0] == pytest.approx(1 / slant, rel=1e-4)


def test_texture_coordinates_belong_to_the_seen_point():
    _, _, planes, _, _ = picture([(1, 1.0, -1), (6, -1.0, -1), (6, -1.0, 1), (1, 1.0, 1)])  # a slanting wall
    p = planes[FIRST]
    x, y = 200.5, 90.5
    z = 1 / (p[0] * x + p[1] * y + p[2])
    across, up = -z * (x - WIDTH / 2) / FOCAL, -z * (y - HEIGHT / 2) / FOCAL
    assert (z - 1) * -2 == pytest.approx((across - 1) * 5)  # on the wall
    assert (p[3] * x + p[4] * y + p[5]) * z + p[6] == pytest.approx(1.0 - across)
    assert (p[7] * x + p[8] * y + p[9]) * z + p[10] == pytest.approx(up + 1.0)


def test_rooms_that_are_not_visible_are_left_out():
    seen = picture(wall(1.0, -0.2, 0.2, -0.2, 0.2), wall(2.0, -1, 1, -1, 1), visible=[0, 1])
    assert seen[4] == 1
    assert seen[3][FIRST] == 1


def test_too_many_polygons_are_left_out():
    quads = [wall(2.0 + i, -1, 1, -1, 1) for i in range(20)]
    seen, _, _, _, drawn = picture(*quads, planes_max=5)
    assert drawn == 5
    assert seen.max() < FIRST + 5


def test_bands_make_the_same_picture_as_the_whole():
    random = np.random.default_rng(4)
    for _ in range(5):
        quads = random.normal(0, 3, (30, 4, 3))
        whole = picture(*quads)
        for band in (8, 48, 64):  # the last one is cut off
            parts = picture(*quads, band=band)
            np.testing.assert_array_equal(parts[0], whole[0])
            np.testing.assert_array_equal(parts[1], whole[1])


def test_random_quads_break_nothing():
    random = np.random.default_rng(3)
    for _ in range(200):
        seen, *_, drawn = picture(*(random.normal(0, 3, (30, 4, 3))))
        assert seen.max() < FIRST + max(drawn, 1)
