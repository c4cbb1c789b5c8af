"""Ways of others by kernels, against the same in array expressions."""

from __future__ import annotations

import numpy as np
import pytest

from roboglot.kernels.distance import facing, join, kinds_at, meets_mover

OFF = 9  # of a place that lies on no cell


def way(rng: np.random.Generator, count: int, step: float) -> np.ndarray:
    """Return a bent way (n, 2; m) from somewhere near the origin."""
    yaw = rng.uniform(-3.0, 3.0) + np.cumsum(rng.normal(0.0, 0.2, count))
    return rng.normal(0.0, 1.0, 2) + np.cumsum(step * np.stack([np.cos(yaw), np.sin(yaw)], axis=1), axis=0)


@pytest.mark.parametrize("seed", range(20))
def test_points_face_others_as_by_arrays(seed: int) -> None:
    rng = np.random.default_rng(seed)
    path, other = way(rng, 20, 0.2), way(rng, 2 + seed, 0.2)
    ahead, its = (np.diff(points, axis=0, append=2.0 * points[-1:] - points[-2:-1]) for points in (path, other))
    cosine = ahead @ its.T / np.hypot(*ahead.T)[:, None] / np.hypot(*its.T)
    away = np.linalg.norm(path[:, None] - other, axis=2)
    assert np.array_equal(facing(path, other, 1.0, 0.5), (away < 1.0) & (cosine < 0.5))


@pytest.mark.parametrize("seed", range(20))
def test_movers_are_met_where_they_stop(seed: int) -> None:
    rng = np.random.default_rng(seed)
    path, other, stops = way(rng, 60, 0.05), way(rng, 8, 0.2), rng.uniform(0.0, 1.6)
    x, y = path[0]
    along = np.arange(8) * 0.2
    last = np.array([np.interp(stops, along, other[:, axis]) for axis in range(2)])
    spots = np.concatenate((other[along < stops], last[None]))
    away, now = np.linalg.norm(path[:, None] - spots, axis=2), np.hypot(*(spots - (x, y)).T)
    hits = ((away < 0.6) & (away < now - 0.01)).any(axis=1)
    assert meets_mover(path, other, stops, x, y, 0.6) == (int(hits.argmax()) if hits.any() else -1)


def test_movers_that_stand_are_not_met() -> None:
    path, here = np.stack([np.arange(0.0, 3.0, 0.05), np.zeros(60)], axis=1), np.array([(1.0, 0.0), (0.8, 0.0)])
    assert meets_mover(path, here, 0.0, 0.0, 0.0, 0.6) == -1


def test_points_have_the_kind_of_their_cells() -> None:
    cells = np.arange(6, dtype=np.uint8).reshape(2, 3)
    points = np.array([(-0.01, 0.06), (0.0, 0.06), (0.04, 0.11), (0.14, 0.14), (0.16, 0.06), (0.06, 0.16), (0.06, 0.0)])
    assert kinds_at(cells, points, 1, 0, 0.05, OFF).tolist() == [OFF, 0, 3, 5, OFF, OFF, OFF]


def test_short_gaps_are_marked() -> None:
    marked = np.array([0, 1, 0, 0, 1, 0, 0, 0, 0, 1], bool)
    join(marked, 3)
    assert np.flatnonzero(marked).tolist() == [1, 2, 3, 4, 9]
