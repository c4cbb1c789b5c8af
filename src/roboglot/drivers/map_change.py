"""Distinguishes a map that has grown from another map: robots send both in the same way."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid

if TYPE_CHECKING:
    import numpy as np
else:
    np = lazy("numpy")

AGREED = 0.5  # share of the walls that are still there, to a cell


def continues(before: OccupancyGrid, after: OccupancyGrid) -> bool:
    """Return whether ``after`` is the map ``before`` in the same frame, perhaps grown or drawn better."""
    if before.resolution != after.resolution:
        return False
    half = before.resolution / 2
    row, column = after.cell_of(Point(before.origin.x + half, before.origin.y + half))
    old = before.log_odds[max(-row, 0) : max(after.height - row, 0), max(-column, 0) : max(after.width - column, 0)]
    new = after.log_odds[max(row, 0) :, max(column, 0) :][: old.shape[0], : old.shape[1]]
    old = old[: new.shape[0], : new.shape[1]]
    known, near = (old != 0) & (new != 0), new > 0
    for axis in (0, 1):
        near = near | np.roll(near, 1, axis) | np.roll(near, -1, axis)
    walls = known & (old > 0)
    return bool(near[walls].mean() > AGREED if walls.any() else known.any())
