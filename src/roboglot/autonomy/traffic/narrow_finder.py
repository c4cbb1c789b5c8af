"""Finding of narrow places, where two robots cannot pass each other: doors, corridors, gaps. Needs the kernels."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.rules import GridFrame
from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.kernels.distance import distances, gaps, kinds_at
from roboglot.model.geometry import Point

HALF = 0.62  # m: half the width that two hulls of 0.27 m need side by side, with 5 cm around each
REACH = 16.0  # m around the robot that are examined: no announced route is longer
KEPT, MOVED = 5.0, 2.0  # s, m after which the map is examined again
TILE = 64  # cells along a side of the pieces in which that is done, when asked
THROUGH = 0.7  # m that are free on both sides of a door, across its gap
HULL = 0.35  # m from a door within which a robot's hull is in it
AXES = np.array(((0, 1), (1, 1), (1, 2), (2, 1)), np.int64)  # directions, in cells, to measure gaps in and across
THICK = 2  # cells by which walls are thickened for that: a thin slanting one does not lie along an axis
AROUND = 2 * math.ceil(HALF / RESOLUTION) + math.ceil(HULL / RESOLUTION) + 4  # cells around a piece that count there
UNSEEN, OPEN, NARROW = 0, 1, 2  # of a cell


def narrow(evidence: NDArray[np.int16]) -> NDArray[np.bool_]:
    """Return the mask of free cells where no disc as wide as two robots fits, or in or close to a door."""
    reach, occupied = HALF / RESOLUTION, evidence > 0
    wide = distances(occupied.astype(np.uint8), reach + 1.0) >= reach
    found: NDArray[np.bool_] = distances(wide.astype(np.uint8), reach + 2.0) > reach + 1.0
    thick = distances(occupied.astype(np.uint8), THICK + 1.0) <= THICK
    doors = _gaps(thick) & ~thick & ~wide & (evidence < 0)
    if doors.any():
        found |= distances(doors.astype(np.uint8), HULL / RESOLUTION + 1.0) <= HULL / RESOLUTION
    return found & (evidence < 0)


def _gaps(thick: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the mask of cells between two obstacles too close for two robots, with floor before and behind.

    Discs from both sides cover a door in a thin wall, so they do not find it. ``thick``: cells within THICK of one.
    """
    wide, deep = 2.0 * (HALF / RESOLUTION - THICK), THROUGH / RESOLUTION - THICK
    return gaps(thick.astype(np.uint8), AXES, wide, deep) > 0


class NarrowFinder:
    """Finder of narrow places in a recent copy of the map around the robot, piece by piece."""

    def __init__(self) -> None:
        self._looked_at, self._around, self._grid = -math.inf, Point(), EvidenceGrid()
        self._first, self._evidence = (0, 0), np.zeros((0, 0), np.int16)
        self._found = np.zeros((0, 0), np.uint8)  # by cell of whole pieces: UNSEEN, OPEN or NARROW
        self._corner = (0, 0)  # row and column of its first cell, counted from the map's origin
        # By piece: what it showed, and its part of ``_found``.
        self._before: dict[tuple[int, int], tuple[NDArray[np.int8], NDArray[np.uint8]]] = {}

    def at(self, grid: EvidenceGrid, points: NDArray[np.float64], now: float) -> NDArray[np.bool_]:
        """Return which of ``points`` (n, 2; map; the first is the robot's) lie in a narrow place.

        No disc as wide as two robots fits into the free floor there, or it is a door.
        """
        self._update(grid, Point(float(points[0, 0]), float(points[0, 1])), now)
        while True:
            found = kinds_at(self._found, points, *self._corner, RESOLUTION, OPEN)
            if (first := found.tobytes().find(UNSEEN)) < 0:
                return np.equal(found, NARROW)
            x, y = points[first].tolist()
            self._examine(math.floor(y / RESOLUTION), math.floor(x / RESOLUTION))

    def contains(self, grid: EvidenceGrid, here: Point, place: Point, now: float) -> bool:
        """Return whether ``place`` (map, m) lies in a narrow place; the robot is ``here``."""
        self._update(grid, here, now)
        at = row, column = math.floor(place.y / RESOLUTION), math.floor(place.x / RESOLUTION)
        row, column = row - self._corner[0], column - self._corner[1]
        if not (0 <= row < self._found.shape[0] and 0 <= column < self._found.shape[1]):
            return False
        if self._found[row, column] == UNSEEN:
            self._examine(*at)
        return bool(self._found[row, column] == NARROW)

    def _examine(self, row: int, column: int) -> None:
        """Examine the piece around a cell, counted from the map's origin."""
        piece = row // TILE, column // TILE
        top, left = (number * TILE - first for number, first in zip(piece, self._corner, strict=True))
        self._found[top : top + TILE, left : left + TILE] = self._examined(piece)

    def _update(self, grid: EvidenceGrid, here: Point, now: float) -> None:
        """Copy the map around ``here`` if the copy is too old, or of another place."""
        if grid is not self._grid or now - self._looked_at > KEPT or here.distance_to(self._around) > MOVED:
            self._look(grid, here)
            self._looked_at, self._around, self._grid = now, here, grid

    def _look(self, grid: EvidenceGrid, here: Point) -> None:
        """Copy the map around ``here``."""
        rows, columns = GridFrame(grid.corner, grid.evidence.shape).around((here,), REACH)
        self._evidence = grid.evidence[rows, columns].copy()
        self._first = first = grid.first_row + rows.start, grid.first_column + columns.start
        ends = first[0] + self._evidence.shape[0], first[1] + self._evidence.shape[1]
        self._corner = first[0] // TILE * TILE, first[1] // TILE * TILE
        height, width = (-(-end // TILE) * TILE - at for end, at in zip(ends, self._corner, strict=True))
        self._found = np.full((height, width), UNSEEN, np.uint8)
        if grid is not self._grid:
            self._before = {}

    def _examined(self, piece: tuple[int, int]) -> NDArray[np.uint8]:
        """Return OPEN or NARROW for each cell of one piece (TILE, TILE), with the cells around it that matter.

        It is examined again only if it has changed since the last time.
        """
        top, left = (number * TILE - first for number, first in zip(piece, self._first, strict=True))
        rows, columns = (slice(max(0, first - AROUND), first + TILE + AROUND) for first in (top, left))
        shown = np.sign(self._evidence[rows, columns]).astype(np.int8)
        before = self._before.get(piece)
        if before is not None and np.array_equal(before[0], shown):
            return before[1]
        found, whole = np.full((TILE, TILE), OPEN, np.uint8), narrow(shown.astype(np.int16))
        first_row, first_column = top - rows.start, left - columns.start  # of the piece in what is shown
        inner = whole[max(0, first_row) : first_row + TILE, max(0, first_column) : first_column + TILE]
        down, along = max(0, -first_row), max(0, -first_column)
        found[down : down + inner.shape[0], along : along + inner.shape[1]] += inner
        self._before[piece] = shown, found
        return found
