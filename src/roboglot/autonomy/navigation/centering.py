"""Centring of a hull in gaps: its offset from the planned path. Knows no robot.

A door may leave the hull less room than a cell of the map; the lidar's echoes are more exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SHIFT_MAX = 0.08  # m: a larger shift would be another route
TANGENT = 3  # points before and after between which the route's direction is measured
PLATEAU, RAMP = 4, 5  # points around a gap that are shifted as much as the gap, and over which the shift fades

Points = NDArray[np.float64]


def sideways(way: Points, echoes: Points, clearance: float) -> tuple[Points, float]:
    """Return the offset (n, 2; m) of each point of ``way`` (n, 2; m, dense), and the width of its narrowest gap (m).

    ``clearance``: m wanted around each point. A point with less on both sides moves to the middle.
    The width is inf where no gap is narrower than twice that.
    """
    from roboglot.kernels.obstacles import sides  # it needs Numba

    count = np.arange(len(way))
    along = way[np.minimum(count + TANGENT, len(way) - 1)] - way[np.maximum(count - TANGENT, 0)]
    length = np.hypot(along[:, 0], along[:, 1])
    along /= np.maximum(length, 1e-9)[:, None]
    upper, lower = np.empty(len(way)), np.empty(len(way))
    sides(way, along, np.ascontiguousarray(echoes), clearance, upper, lower)
    gap = np.isfinite(upper) & np.isfinite(lower) & (lower > upper) & (length > 0.0)
    if not gap.any():
        return np.zeros_like(way), np.inf
    width = 2.0 * clearance + float((upper - lower)[gap].min())
    middle = (np.where(gap, upper, 0.0) + np.where(gap, lower, 0.0)) / 2.0
    shift = _spread(np.where(np.abs(middle) <= SHIFT_MAX, middle, 0.0))
    return shift[:, None] * np.stack([-along[:, 1], along[:, 0]], axis=1), width


def _spread(shift: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the shifts, extended before and behind each gap, so that the way bends gently."""
    window = 2 * PLATEAU + 1
    views = np.lib.stride_tricks.sliding_window_view(np.pad(shift, PLATEAU), window)
    widest = views[np.arange(len(shift)), np.abs(views).argmax(axis=1)]
    spread: NDArray[np.float64] = np.convolve(np.pad(widest, RAMP // 2, mode="edge"), np.ones(RAMP) / RAMP, "valid")
    return spread
