"""Detects driving between two walls with little room, by the lidar's points beside the robot in four stretches."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

HALF_LENGTH, STRETCHES = 0.6, 4  # m ahead and behind that count, and the number of stretches they are cut into
ROOM = 0.3  # m on either side of the hull that count as little room
WIDE_AFTER = 5  # scans without walls before the next corridor is a new one


class NarrowPassage:
    """Detector that reports each corridor once. A doorway is too short for a corridor."""

    def __init__(self, radius: float) -> None:
        from roboglot.kernels.obstacles import corridor  # it needs Numba

        self._corridor: Callable[[NDArray[np.float64], float, int], float] = corridor
        self._width = 2 * (radius + ROOM)
        self._wide = WIDE_AFTER

    def entered(self, points: NDArray[np.float64]) -> float | None:
        """Return the corridor's width (m) if ``points`` (n, 2; base_link, m) show that the robot has entered one."""
        width = self._between(points)
        if width is None:
            self._wide += 1
            return None
        before, self._wide = self._wide, 0
        return width if before >= WIDE_AFTER else None

    def _between(self, points: NDArray[np.float64]) -> float | None:
        width = self._corridor(points, HALF_LENGTH, STRETCHES)
        return width if width <= self._width else None
