"""The way ahead by kernels, against the same in array expressions."""

from __future__ import annotations

import numpy as np
import pytest

from roboglot.kernels.obstacles import centring, nearest_point, sides, things, way_ahead
from roboglot.kernels.occupancy import placed

CLEARANCE, MOST = 0.37, 0.08  # m
TANGENT, PLATEAU, RAMP = 3, 4, 5  # points


def winding(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return a dense way (n, 2; m)."""
    yaw = np.cumsum(rng.normal(0.0, 0.05, count))
    return np.cumsum(0.05 * np.stack([np.cos(yaw), np.sin(yaw)], axis=1), axis=0)


def centred(way: np.ndarray, echoes: np.ndarray) -> tuple[np.ndarray, float]:
    """Return what ``centring`` is to return."""
    count = np.arange(len(way))
    along = way[np.minimum(count + TANGENT, len(way) - 1)] - way[np.maximum(count - TANGENT, 0)]
    along /= np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)[:, None]
    upper, lower = np.empty(len(way)), np.empty(len(way))
    sides(way, along, echoes, CLEARANCE, upper, lower)
    gap = np.isfinite(upper) & np.isfinite(lower) & (lower > upper)
    if not gap.any():
        return np.zeros_like(way), np.inf
    width = 2.0 * CLEARANCE + float((upper - lower)[gap].min())
    middle = (np.where(gap, upper, 0.0) + np.where(gap, lower, 0.0)) / 2.0
    shift = np.pad(np.where(np.abs(middle) <= MOST, middle, 0.0), PLATEAU)
    views = np.lib.stride_tricks.sliding_window_view(shift, 2 * PLATEAU + 1)
    widest = views[count, np.abs(views).argmax(axis=1)]
    faded = np.convolve(np.pad(widest, RAMP // 2, mode="edge"), np.ones(RAMP) / RAMP, "valid")
    return faded[:, None] * np.stack([-along[:, 1], along[:, 0]], axis=1), width


@pytest.mark.parametrize("seed", range(30))
def test_gaps_are_centred_like_by_arrays(seed: int) -> None:
    rng = np.random.default_rng(seed)
    way = winding(rng, 30 if seed % 3 else int(rng.integers(1, 30)))
    echoes = way[rng.integers(0, len(way), seed)] + rng.normal(0.0, 0.3, (seed, 2))
    offset, width = centring(way, echoes, CLEARANCE, MOST, TANGENT, PLATEAU, RAMP)
    expected, wide = centred(way, echoes)
    assert offset == pytest.approx(expected, abs=1e-12)
    assert width == pytest.approx(wide)


def test_first_of_the_nearest_points_counts() -> None:
    points = np.array([(9.0, 9.0), (1.0, 0.0), (0.0, 1.0), (0.0, 0.1)])
    assert nearest_point(points, 0, 3, 0.0, 0.0) == (1, 1.0)
    assert nearest_point(points, 2, 4, 0.0, 0.0) == (3, pytest.approx(0.1))


def test_way_goes_straight_to_the_carrot() -> None:
    points = np.array([(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)])
    way = way_ahead(points, 2, 4, 1.0, 1.0, 1.0, 0.0, 2)
    assert way.tolist() == [[1.0, 1.0], [1.0, 0.5], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]
    assert way_ahead(points, 4, 4, 1.0, 1.0, 1.0, 1.0, 0).tolist() == [[1.0, 1.0]]


def test_things_are_close_echoes_off_the_map() -> None:
    evidence = np.full((100, 100), -500, np.int16)
    evidence[:, 80] = 500
    leg = np.array([(1.0, 1.0), (1.1, 1.0), (1.2, 1.0)])
    wall, lone = np.array([(4.02, 2.0), (4.02, 2.1), (4.02, 2.2)]), np.array([(3.0, 3.0)])
    wide = np.array([(2.0 + 0.2 * number, 4.0) for number in range(6)])
    around = np.concatenate([leg[1:], wall, lone, wide, leg[:1]])  # the scan begins in the midst of the leg
    found = things(evidence, around, 0.0, 0.0, 0.05, 0.25, 0.9, 3)
    assert found == pytest.approx(np.array([(1.1, 1.0)]))
    assert not len(things(evidence, around[:0], 0.0, 0.0, 0.05, 0.25, 0.9, 3))
    assert len(things(evidence, leg, 0.0, 0.0, 0.05, 0.25, 0.9, 3)) == 1


def test_placed_ends_have_their_bounds() -> None:
    ends = np.random.default_rng(1).normal(0.0, 3.0, (50, 2))
    found, low_x, high_x, low_y, high_y = placed(ends, 1.0, 2.0, 0.7)
    turn = np.array([[np.cos(0.7), np.sin(0.7)], [-np.sin(0.7), np.cos(0.7)]])
    assert found == pytest.approx(ends @ turn + (1.0, 2.0))
    assert ((low_x, low_y), (high_x, high_y)) == (tuple(found.min(axis=0)), tuple(found.max(axis=0)))
