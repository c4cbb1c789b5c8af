"""Poses of scanners on their robots: upright, or mounted upside down."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Pose

LEVEL = math.radians(5.0)  # the scans of a scanner tilted further show no floor plan


def rotation(w: float, x: float, y: float, z: float) -> NDArray[np.float64]:
    """Return the matrix (3, 3) of a unit quaternion."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def level_mount(turned: NDArray[np.float64], x: float, y: float) -> tuple[Pose, bool]:
    """Return a scanner's pose in the plane, and True if it is upside down.

    ``turned``: its rotation matrix (3, 3); ``x``, ``y``: its position in base_link, m. Raises ValueError if it is
    tilted.
    """
    if abs(turned[2, 2]) < math.cos(LEVEL):
        raise ValueError("the scanner is tilted")
    return Pose(x, y, math.atan2(turned[1, 0], turned[0, 0])), bool(turned[2, 2] < 0)
