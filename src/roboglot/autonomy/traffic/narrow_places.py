"""Narrow places of the map, in which two robots cannot pass each other: doors, corridors, gaps. Needs the kernels."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.rules import Frame
from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.kernels.distance import distances
from roboglot.model.geometry import Point

HALF = 0.62  # m: half the width that two hulls of 0.27 m need side by side, with 5 cm around each
REACH = 16.0  # m around the robot that are examined: no announced route is longer
KEPT, MOVED = 5.0, 2.0  # s, m after which the map is examined again


def narrow(evidence: NDArray[np.int16]) -> NDArray[np.bool_]:
    """The free cells in which no disc as wide as two robots fits."""
    reach = HALF / RESOLUTION
    wide = distances((evidence > 0).astype(np.uint8), reach + 1.0) >= reach
    found: NDArray[np.bool_] = (distances(wide.astype(np.uint8), reach + 2.0) > reach + 1.0) & (evidence < 0)
    return found


class NarrowPlaces:
    """Finds them in the map around the robot, now and then."""

    def __init__(self) -> None:
        self._looked_at, self._around, self._grid = -math.inf, Point(), EvidenceGrid()
        self._first, self._narrow = (0, 0), np.zeros((0, 0), bool)

    def at(self, grid: EvidenceGrid, points: NDArray[np.float64], now: float) -> NDArray[np.bool_]:
        """Return which of ``points`` (n, 2; map; the first is the robot's) lie in a narrow place.

        No disc as wide as two robots fits there into the free floor.
        """
        here = Point(float(points[0, 0]), float(points[0, 1]))
        if grid is not self._grid or now - self._looked_at > KEPT or here.distance_to(self._around) > MOVED:
            self._look(grid, here)
            self._looked_at, self._around, self._grid = now, here, grid
        cells = np.floor(points / RESOLUTION).astype(np.intp) - self._first
        inside = ((cells >= 0) & (cells < (self._narrow.shape[1], self._narrow.shape[0]))).all(axis=1)
        found = np.zeros(len(points), bool)
        found[inside] = self._narrow[cells[inside, 1], cells[inside, 0]]
        return found

    def _look(self, grid: EvidenceGrid, here: Point) -> None:
        rows, columns = Frame(grid.corner, grid.evidence.shape).around((here,), REACH)
        self._narrow = narrow(grid.evidence[rows, columns])
        self._first = (grid.first_column + columns.start, grid.first_row + rows.start)
