"""Straightening a path of cells where the straight line costs no more."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import Int32Array, SingleArray
from roboglot.kernels.compiled import kernel

SIGHT_MAX = 160  # cells of path that one straight line may replace
STEP = 0.5  # cells between two samples of a line


@kernel("float64(float32[:,::1], float64, float64, float64, float64)")
def line_cost(cost: SingleArray, row0: float, col0: float, row1: float, col1: float) -> float:
    """Cost of the straight line between two points (in cells; a cell's centre has whole numbers); inf if closed."""
    length = np.sqrt((row1 - row0) ** 2 + (col1 - col0) ** 2)
    count = max(1, int(np.ceil(length / STEP)))
    total = 0.0
    for i in range(count + 1):
        share = i / count
        value = cost[int(np.rint(row0 + share * (row1 - row0))), int(np.rint(col0 + share * (col1 - col0)))]
        if not np.isfinite(value):
            return np.inf
        total += value * (0.5 if i == 0 or i == count else 1.0)
    return float(total * length / count)


@kernel("int32[::1](float32[:,::1], int32[:,::1], float64)")
def corners(cost: SingleArray, path: Int32Array, slack: float) -> Int32Array:
    """Indices of the cells of ``path`` to keep: between two of them the line costs at most ``slack`` times the path."""
    count = path.shape[0]
    kept = np.empty(max(count, 1), np.int32)
    if count == 0:
        return kept[:0].copy()
    along = np.zeros(count)
    for i in range(1, count):
        along[i] = along[i - 1] + line_cost(cost, path[i - 1, 0], path[i - 1, 1], path[i, 0], path[i, 1])
    kept[0] = 0
    number, at = 1, 0
    while at < count - 1:
        following = at + 1
        for other in range(min(count - 1, at + SIGHT_MAX), at + 1, -1):
            straight = line_cost(cost, path[at, 0], path[at, 1], path[other, 0], path[other, 1])
            if straight <= slack * (along[other] - along[at]):
                following = other
                break
        kept[number] = following
        number += 1
        at = following
    return kept[:number].copy()
