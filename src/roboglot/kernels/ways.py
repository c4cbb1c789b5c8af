"""Ways of others beside a robot's own: where both meet, what may stop on it, and which stretches are narrow."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import BoolArray, ByteArray, FloatArray
from roboglot.kernels.compiled import kernel

SHORTEST = 1e-6  # m: shorter pieces of a way have no direction


@kernel("uint8[::1](uint8[:,::1], float64[:,::1], int64, int64, float64, uint8)")
def kinds_at(cells: ByteArray, points: FloatArray, row: int, col: int, resolution: float, off: int) -> ByteArray:
    """Return the value of the cell under each of ``points`` (n, 2; m); ``off`` outside of the grid.

    The first of the ``cells`` is at (row, col), counted from the origin of the points' frame.
    """
    (height, width), found = cells.shape, np.empty(points.shape[0], np.uint8)
    for i in range(points.shape[0]):
        r, c = int(np.floor(points[i, 1] / resolution)) - row, int(np.floor(points[i, 0] / resolution)) - col
        found[i] = cells[r, c] if 0 <= r < height and 0 <= c < width else off
    return found


@kernel("void(boolean[::1], int64)")
def join(marked: BoolArray, longest: int) -> None:
    """Mark what lies between two marked places up to ``longest`` apart."""
    last = -1
    for i in range(len(marked)):
        if marked[i]:
            for k in range(last + 1, i if last >= 0 and i - last <= longest else 0):
                marked[k] = True
            last = i


@kernel("float64[:,::1](float64[:,::1])")
def _directions(way: FloatArray) -> FloatArray:
    """Return unit vectors along a way (n, 2), from each point to the next; the last is as the one before."""
    found, last = np.zeros(way.shape), len(way) - 1
    for i in range(last + 1 if last > 0 else 0):
        k = min(i, last - 1)
        x, y = way[k + 1, 0] - way[k, 0], way[k + 1, 1] - way[k, 1]
        length = max(np.hypot(x, y), SHORTEST)
        found[i, 0], found[i, 1] = x / length, y / length
    return found


@kernel("boolean[:,::1](float64[:,::1], float64[:,::1], float64, float64)")
def facing(path: FloatArray, way: FloatArray, reach: float, alike: float) -> BoolArray:
    """Return which points of ``path`` (n, 2; m) lie within ``reach`` of those of ``way`` (k, 2; m) and lead elsewhere.

    That is, the cosine of the angle between the two directions is less than ``alike``.
    """
    found, ahead, its = np.zeros((len(path), len(way)), np.bool_), _directions(path), _directions(way)
    for i in range(len(path)):
        for j in range(len(way)):
            if np.hypot(path[i, 0] - way[j, 0], path[i, 1] - way[j, 1]) < reach:
                found[i, j] = ahead[i, 0] * its[j, 0] + ahead[i, 1] * its[j, 1] < alike
    return found


@kernel("int64(float64[:,::1], float64[:,::1], float64, float64, float64, float64)")
def meets_mover(path: FloatArray, way: FloatArray, stops: float, x: float, y: float, reach: float) -> int:
    """Return the number of the first point of ``path`` (n, 2; m) within ``reach`` of a mover that brakes; -1: none is.

    It may be at the points of its ``way`` (k, 2; m) up to ``stops`` m. Those that a robot at (x, y) moves away from do
    not count.
    """
    spots, count, along = np.empty((len(way), 2)), 0, 0.0
    for j in range(len(way)):
        step = np.hypot(way[j, 0] - way[j - 1, 0], way[j, 1] - way[j - 1, 1]) if j > 0 else 0.0
        share = min(1.0, (stops - along) / step) if step > 0.0 else 1.0
        if share <= 0.0:
            break
        before = max(0, j - 1)
        spots[count, 0] = way[before, 0] + share * (way[j, 0] - way[before, 0])
        spots[count, 1] = way[before, 1] + share * (way[j, 1] - way[before, 1])
        along, count = along + step, count + 1
    for i in range(len(path) if count > 1 else 0):
        for j in range(count):
            away = np.hypot(path[i, 0] - spots[j, 0], path[i, 1] - spots[j, 1])
            if away < reach and away < np.hypot(spots[j, 0] - x, spots[j, 1] - y) - 0.01:
                return i
    return -1
