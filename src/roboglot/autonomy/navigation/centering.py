"""Centring of a hull between what it passes: its offset from the planned path. Knows no robot.

Maps have cells; a door that leaves a hull less than a cell's room is met by what the lidar sees of it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SHIFT_MAX = 0.08  # m: a larger shift would be another route
TANGENT = 3  # points before and after between which the route's direction is measured
PLATEAU, RAMP = 4, 5  # points around a gap that are shifted as much as the gap, and over which the shift fades

Points = NDArray[np.float64]


def sideways(way: Points, echoes: Points, clearance: float) -> tuple[Points, float]:
    """By what each point of ``way`` (n, 2; m, dense) is to move, and the width of the narrowest gap on it (m).

    ``clearance``: m that are wanted around each point. Where there is less on both sides, it moves to the middle.
    The width is inf where no gap is narrower than twice that.
    """
    count = np.arange(len(way))
    along = way[np.minimum(count + TANGENT, len(way) - 1)] - way[np.maximum(count - TANGENT, 0)]
    length = np.hypot(along[:, 0], along[:, 1])
    along /= np.maximum(length, 1e-9)[:, None]
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    echoes = _around(way, echoes, 3.0 * clearance)
    x, y = echoes[None, :, 0] - way[:, None, 0], echoes[None, :, 1] - way[:, None, 1]
    ahead = np.abs(x * along[:, None, 0] + y * along[:, None, 1])
    left = x * normal[:, None, 0] + y * normal[:, None, 1]
    near = (ahead < clearance) & (np.abs(left) < 2.0 * clearance)
    reach = np.sqrt(np.maximum(0.0, clearance**2 - ahead**2))
    upper = np.where(near & (left > 0.0), left - reach, np.inf).min(axis=1, initial=np.inf)
    lower = np.where(near & (left <= 0.0), left + reach, -np.inf).max(axis=1, initial=-np.inf)
    gap = np.isfinite(upper) & np.isfinite(lower) & (lower > upper) & (length > 0.0)
    if not gap.any():
        return np.zeros_like(way), np.inf
    width = 2.0 * clearance + float((upper - lower)[gap].min())
    middle = (np.where(gap, upper, 0.0) + np.where(gap, lower, 0.0)) / 2.0
    shift = _spread(np.where(np.abs(middle) <= SHIFT_MAX, middle, 0.0))
    return shift[:, None] * normal, width


def _around(way: Points, echoes: Points, reach: float) -> Points:
    """Those of ``echoes`` that may be within ``reach`` m of the way."""
    low, high = way.min(axis=0) - reach, way.max(axis=0) + reach
    x, y = echoes[:, 0], echoes[:, 1]
    near: Points = echoes[(x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])]
    return near


def _spread(shift: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same, begun before each gap and kept until behind it, so that the way bends gently."""
    window = 2 * PLATEAU + 1
    views = np.lib.stride_tricks.sliding_window_view(np.pad(shift, PLATEAU), window)
    widest = views[np.arange(len(shift)), np.abs(views).argmax(axis=1)]
    spread: NDArray[np.float64] = np.convolve(np.pad(widest, RAMP // 2, mode="edge"), np.ones(RAMP) / RAMP, "valid")
    return spread
