"""True if the robot drives between two walls with little room: what its lidar sees beside it, in four stretches."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

HALF_LENGTH, STRETCHES = 0.6, 4  # m ahead and behind that count, and the number of stretches they are cut into
ROOM = 0.3  # m on either side of the hull that count as little room
WIDE_AFTER = 5  # scans without walls before the next corridor is a new one


class NarrowWatch:
    """Examines every scan and reports each corridor once. A doorway is no corridor: it has no length."""

    def __init__(self, radius: float) -> None:
        from roboglot.kernels.obstacles import corridor  # it needs Numba

        self._corridor: Callable[[NDArray[np.float64], float, int], float] = corridor
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
        width = self._corridor(points, HALF_LENGTH, STRETCHES)
        return width if width <= self._width else None
