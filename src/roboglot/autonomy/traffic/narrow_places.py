"""Narrow places of the map, where two robots cannot pass each other: doors, corridors, gaps. Needs the kernels."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.rules import GridFrame
from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.kernels.distance import distances
from roboglot.model.geometry import Point

HALF = 0.62  # m: half the width that two hulls of 0.27 m need side by side, with 5 cm around each
REACH = 16.0  # m around the robot that are examined: no announced route is longer
KEPT, MOVED = 5.0, 2.0  # s, m after which the map is examined again
TILE = 64  # cells along a side of the pieces in which that is done, when asked
AROUND = 2 * math.ceil(HALF / RESOLUTION) + 4  # cells around a piece that count there


def narrow(evidence: NDArray[np.int16]) -> NDArray[np.bool_]:
    """Return the mask of free cells where no disc as wide as two robots fits."""
    reach = HALF / RESOLUTION
    wide = distances((evidence > 0).astype(np.uint8), reach + 1.0) >= reach
    found: NDArray[np.bool_] = (distances(wide.astype(np.uint8), reach + 2.0) > reach + 1.0) & (evidence < 0)
    return found


class NarrowPlaces:
    """Finder of narrow places in a recent copy of the map around the robot, piece by piece."""

    def __init__(self) -> None:
        self._looked_at, self._around, self._grid = -math.inf, Point(), EvidenceGrid()
        self._first, self._evidence = (0, 0), np.zeros((0, 0), np.int16)
        self._narrow, self._known = np.zeros((0, 0), bool), np.zeros((0, 0), bool)  # by cell, and by piece

    def at(self, grid: EvidenceGrid, points: NDArray[np.float64], now: float) -> NDArray[np.bool_]:
        """Return which of ``points`` (n, 2; map; the first is the robot's) lie in a narrow place.

        No disc as wide as two robots fits into the free floor there.
        """
        here = Point(float(points[0, 0]), float(points[0, 1]))
        if grid is not self._grid or now - self._looked_at > KEPT or here.distance_to(self._around) > MOVED:
            self._look(grid, here)
            self._looked_at, self._around, self._grid = now, here, grid
        (first_x, first_y), (height, width) = self._first, self._narrow.shape
        found = np.zeros(len(points), bool)
        for number, (x, y) in enumerate(np.floor(points / RESOLUTION).astype(np.intp).tolist()):
            row, column = y - first_y, x - first_x
            if 0 <= row < height and 0 <= column < width:
                if not self._known[row // TILE, column // TILE]:
                    self._examine(row // TILE, column // TILE)
                found[number] = self._narrow[row, column]
        return found

    def _look(self, grid: EvidenceGrid, here: Point) -> None:
        """Copy the map around ``here``."""
        rows, columns = GridFrame(grid.corner, grid.evidence.shape).around((here,), REACH)
        self._evidence = grid.evidence[rows, columns].copy()
        height, width = self._evidence.shape
        self._narrow = np.zeros((height, width), bool)
        self._known = np.zeros((-(-height // TILE), -(-width // TILE)), bool)
        self._first = (grid.first_column + columns.start, grid.first_row + rows.start)

    def _examine(self, down: int, along: int) -> None:
        """Examine one piece, with the cells around it that matter."""
        self._known[down, along] = True
        row, column = down * TILE, along * TILE
        top, left = max(0, row - AROUND), max(0, column - AROUND)
        part = np.ascontiguousarray(self._evidence[top : row + TILE + AROUND, left : column + TILE + AROUND])
        inner = slice(row - top, row - top + TILE), slice(column - left, column - left + TILE)
        self._narrow[row : row + TILE, column : column + TILE] = narrow(part)[inner]
