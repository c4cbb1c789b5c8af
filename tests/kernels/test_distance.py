"""The distance transform, both ways of it, against the definition."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from roboglot.kernels.distance import NEAR_MAX, distances, gaps, mark_beside, mark_inside


@settings(max_examples=100, deadline=None)
@given(
    arrays(np.uint8, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=st.integers(0, 1)), st.floats(1, 30)
)
def test_distances_are_exact_up_to_the_cap(marked: np.ndarray, cap: float) -> None:
    rows, cols = np.indices(marked.shape)
    expected = np.full(marked.shape, cap)
    for row, col in np.argwhere(marked):
        expected = np.minimum(expected, np.hypot(rows - row, cols - col))
    np.testing.assert_allclose(distances(marked, cap), expected, rtol=1e-5)


@settings(max_examples=30, deadline=None)
@given(arrays(np.uint8, st.tuples(st.integers(1, 40), st.integers(1, 40)), elements=st.integers(0, 1), fill=st.just(0)))
def test_near_and_far_agree_to_the_bit(marked: np.ndarray) -> None:
    near, far = distances(marked, NEAR_MAX), distances(marked, NEAR_MAX + 1.0)
    assert (near[near < NEAR_MAX] == far[near < NEAR_MAX]).all()
    assert (far[near == NEAR_MAX] >= NEAR_MAX).all()


def free(occupied: np.ndarray, row: int, col: int, down: int, along: int, far: int) -> int:
    """Return how many cells that way are free, ``far`` at most."""
    for count in range(far):
        r, c = row + (count + 1) * down, col + (count + 1) * along
        if 0 <= r < occupied.shape[0] and 0 <= c < occupied.shape[1] and occupied[r, c]:
            return count
    return far


@settings(max_examples=40, deadline=None)
@given(
    arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 1), fill=st.just(0)),
    st.tuples(st.integers(0, 2), st.integers(0, 2)).filter(any),
    st.floats(1, 8),
    st.floats(1, 6),
)
def test_gaps_are_narrow_and_lead_through(
    occupied: np.ndarray, axis: tuple[int, int], wide: float, deep: float
) -> None:
    (down, along), step = axis, np.hypot(*axis)
    far = int(np.ceil(wide / step))
    found = gaps(occupied, np.array([axis]), wide, deep)
    for row, col in np.ndindex(occupied.shape):
        ways = [(down, along), (-down, -along), (along, -down), (-along, down)]
        one, other, left, right = (free(occupied, row, col, *way, far) for way in ways)
        is_gap = (one + other + 1) * step < wide and min(left, right) * step >= deep
        is_gap |= (left + right + 1) * step < wide and min(one, other) * step >= deep
        assert found[row, col] == is_gap


PLACES = st.floats(-3, 3) | st.sampled_from([-1e5, 0.0, 1e5])


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(PLACES, PLACES), min_size=2, max_size=4), st.floats(0.03, 0.5))
def test_cells_beside_a_line_are_those_within_reach(points: list[tuple[float, float]], reach: float) -> None:
    mask, way = np.zeros((30, 40), np.bool_), np.array(points, np.float64)
    mark_beside(mask, way, -1.0, -0.7, 0.05, reach)
    x, y = -1.0 + (np.arange(40) + 0.5) * 0.05, (-0.7 + (np.arange(30) + 0.5) * 0.05)[:, None]
    away = np.full(mask.shape, np.inf)
    for a, b in itertools.pairwise(way):
        dx, dy = b - a
        share = np.clip(((x - a[0]) * dx + (y - a[1]) * dy) / max(dx * dx + dy * dy, 1e-12), 0.0, 1.0)
        away = np.minimum(away, np.hypot(x - a[0] - share * dx, y - a[1] - share * dy))
    sure = np.abs(away - reach) > 1e-6
    assert (mask == (away <= reach))[sure].all()


@settings(max_examples=100, deadline=None)
@given(PLACES, PLACES, PLACES, PLACES, st.floats(0.03, 4.0))
def test_cells_inside_an_area_lie_in_its_rectangle(x1: float, y1: float, x2: float, y2: float, half: float) -> None:
    mask, length = np.zeros((30, 40), np.bool_), float(np.hypot(x2 - x1, y2 - y1))
    mark_inside(mask, np.array([x1, y1], np.float64), np.array([x2, y2], np.float64), half, -1.0, -0.7, 0.05)
    if length == 0.0:
        assert not mask.any()
        return
    x, y = -1.0 + (np.arange(40) + 0.5) * 0.05 - x1, (-0.7 + (np.arange(30) + 0.5) * 0.05)[:, None] - y1
    along, beside = (x * (x2 - x1) + y * (y2 - y1)) / length, np.abs(y * (x2 - x1) - x * (y2 - y1)) / length
    edges = np.minimum(np.minimum(np.abs(along), np.abs(along - length)), np.abs(beside - half))
    expected = (along >= 0.0) & (along <= length) & (beside <= half)
    assert (mask == expected)[edges > 1e-6].all()
