"""Waiting places: the nearest place off the others' ways, to let them pass. Needs the kernels."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.rules import GridFrame
from roboglot.autonomy.slam.evidence import RESOLUTION
from roboglot.autonomy.traffic.narrow_finder import narrow
from roboglot.kernels.distance import distances
from roboglot.kernels.search import ways_from
from roboglot.model.geometry import Point

REACH = 6.0  # m around the robot that are searched
SHUN_COST = 4.0  # extra cost of a cell on another robot's route
SHUN_POINTS = 40
NARROW_COST = 60.0  # extra cost of waiting in a narrow place: equal to 3 m of open floor
MOUTH, MOUTH_COST = 0.6, 20.0  # m around a narrow place where others come out, and the cost of waiting there

Points = NDArray[np.float64]


def shun(cost: NDArray[np.float32], frame: GridFrame, ways: Sequence[tuple[Points, float]]) -> None:
    """Raise the cost of the cells within each way's distance (m)."""
    for points, reach in ways:
        window, away = _distances(frame, points[:SHUN_POINTS], reach)
        cost[window] += np.where(away < reach, np.float32(SHUN_COST), np.float32(0.0))


def waiting_place(
    cost: NDArray[np.float32],
    evidence: NDArray[np.int16],
    frame: GridFrame,
    here: Point,
    ways: Sequence[tuple[Points, float]],
) -> Point | None:
    """Return the place of least cost that keeps the distances (m) to all ways; None: there is none.

    In a narrow place it would block a third robot: a place beyond is better, up to a few metres off.
    """
    rows, columns = frame.around((here,), REACH)
    near = np.ascontiguousarray(cost[rows, columns])
    row, column = (
        int((v - c) // RESOLUTION) - s.start
        for v, c, s in zip((here.y, here.x), (frame.corner.y, frame.corner.x), (rows, columns), strict=True)
    )
    if not (0 <= row < near.shape[0] and 0 <= column < near.shape[1]):
        return None
    near[row, column] = min(near[row, column], 10.0)
    paid = ways_from(near, row, column)
    tight, mouth = narrow(evidence[rows, columns]), MOUTH / RESOLUTION
    paid += np.where(tight, np.float32(NARROW_COST), np.float32(0.0))
    if tight.any():
        paid += np.where(
            distances(tight.astype(np.uint8), mouth + 1.0) <= mouth, np.float32(MOUTH_COST), np.float32(0.0)
        )
    corner = Point(frame.corner.x + columns.start * RESOLUTION, frame.corner.y + rows.start * RESOLUTION)
    part = GridFrame(corner, (near.shape[0], near.shape[1]))
    for points, reach in ways:
        window, away = _distances(part, points[:SHUN_POINTS], reach)
        paid[window] = np.where(away < reach, np.float32(math.inf), paid[window])
    best = np.unravel_index(int(paid.argmin()), paid.shape)
    if not np.isfinite(paid[best]):
        return None
    return Point(corner.x + (int(best[1]) + 0.5) * RESOLUTION, corner.y + (int(best[0]) + 0.5) * RESOLUTION)


def _distances(frame: GridFrame, points: Points, reach: float) -> tuple[tuple[slice, slice], Points]:
    """Return the part of a grid around ``points``, and its cells' distances to the nearest of them, m."""
    window = frame.around(tuple(Point(x, y) for x, y in points.tolist()), reach)
    x, y = frame.centres(*window)
    away = np.full((window[0].stop - window[0].start, window[1].stop - window[1].start), math.inf)
    for px, py in points.tolist():
        np.minimum(away, np.hypot(x - px, y - py), out=away)
    return window, away
