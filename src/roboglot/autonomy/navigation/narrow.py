"""True if the robot drives between two walls with little room: what its lidar sees beside it, in four stretches."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

HALF_LENGTH, STRETCHES = 0.6, 4  # m ahead and behind that count, and into how many stretches they are cut
ROOM = 0.3  # m on either side, beyond the hull, that is little
WIDE_AFTER = 5  # scans without walls until the next corridor is another one


class NarrowWatch:
    """Examines every scan and reports each corridor once. A doorway is no corridor: it has no length."""

    def __init__(self, radius: float) -> None:
        self._width = 2 * (radius + ROOM)
        self._wide = WIDE_AFTER

    def entered(self, points: NDArray[np.float64]) -> float | None:
        """The corridor's width (m) when ``points`` (n, 2; base_link, m) show that the robot has come into one."""
        width = self._between(points)
        if width is None:
            self._wide += 1
            return None
        before, self._wide = self._wide, 0
        return width if before >= WIDE_AFTER else None

    def _between(self, points: NDArray[np.float64]) -> float | None:
        beside = points[np.abs(points[:, 0]) < HALF_LENGTH]
        if len(beside) < 2 * STRETCHES:
            return None
        stretch = ((beside[:, 0] + HALF_LENGTH) * (STRETCHES / (2 * HALF_LENGTH))).astype(np.intp)
        left, right = np.full(STRETCHES, np.inf), np.full(STRETCHES, np.inf)
        up = beside[:, 1] > 0.0
        np.minimum.at(left, stretch[up], beside[up, 1])
        np.minimum.at(right, stretch[~up], -beside[~up, 1])
        width = float((left + right).max())
        return width if width <= self._width else None
