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
    from roboglot.kernels.obstacles import centring  # it needs Numba

    offset, width = centring(way, np.ascontiguousarray(echoes), clearance, SHIFT_MAX, TANGENT, PLATEAU, RAMP)
    return offset, width
