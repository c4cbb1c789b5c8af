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
THROUGH = 0.7  # m that are free on both sides of a door, across its gap
HULL = 0.35  # m from a door within which a robot's hull is in it
AXES = ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, -1), (2, 1), (1, -2))  # directions, in cells, to measure gaps in
THICK = 2  # cells by which walls are thickened for that: a thin slanting one does not lie along an axis
AROUND = 2 * math.ceil(HALF / RESOLUTION) + math.ceil(HULL / RESOLUTION) + 4  # cells around a piece that count there


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
    found, narrow_cells = np.zeros(thick.shape, bool), 2.0 * (HALF / RESOLUTION - THICK)
    steps = {axis: math.hypot(*axis) for axis in AXES}
    rays = {
        way: _free_cells(thick, way, math.ceil(narrow_cells / steps[axis]))
        for axis in AXES
        for way in (axis, (-axis[0], -axis[1]))
    }
    for (down, along), step in steps.items():
        across = (rays[down, along] + rays[-down, -along] + 1) * step < narrow_cells
        ahead, behind = (rays[way] for way in ((along, -down), (-along, down)))
        found |= across & (np.minimum(ahead, behind) * step >= THROUGH / RESOLUTION - THICK)
    return found


def _free_cells(occupied: NDArray[np.bool_], way: tuple[int, int], far: int) -> NDArray[np.int16]:
    """Return the number of cells, ``far`` at most, between each cell and the next occupied one that way."""
    height, width = occupied.shape
    reach = far * max(map(abs, way))
    around = np.pad(occupied, reach)
    found, free = np.zeros(occupied.shape, np.int16), np.ones(occupied.shape, bool)
    for k in range(1, far + 1):
        top, left = reach + k * way[0], reach + k * way[1]
        free &= ~around[top : top + height, left : left + width]
        found += free
    return found


class NarrowPlaces:
    """Finder of narrow places in a recent copy of the map around the robot, piece by piece."""

    def __init__(self) -> None:
        self._looked_at, self._around, self._grid = -math.inf, Point(), EvidenceGrid()
        self._first, self._evidence = (0, 0), np.zeros((0, 0), np.int16)
        self._now: dict[tuple[int, int], NDArray[np.bool_]] = {}  # narrow cells of the pieces examined since
        self._before: dict[tuple[int, int], tuple[NDArray[np.int8], NDArray[np.bool_]]] = {}  # … of what they showed

    def at(self, grid: EvidenceGrid, points: NDArray[np.float64], now: float) -> NDArray[np.bool_]:
        """Return which of ``points`` (n, 2; map; the first is the robot's) lie in a narrow place.

        No disc as wide as two robots fits into the free floor there, or it is a door.
        """
        here = Point(float(points[0, 0]), float(points[0, 1]))
        if grid is not self._grid or now - self._looked_at > KEPT or here.distance_to(self._around) > MOVED:
            self._look(grid, here)
            self._looked_at, self._around, self._grid = now, here, grid
        (first_row, first_column), (height, width) = self._first, self._evidence.shape
        columns, rows = np.floor(points / RESOLUTION).astype(np.intp).T
        within = (rows >= first_row) & (rows < first_row + height)
        within &= (columns >= first_column) & (columns < first_column + width)
        found, down, along = np.zeros(len(points), bool), rows // TILE, columns // TILE
        for piece in set(zip(down[within].tolist(), along[within].tolist(), strict=True)):
            if piece not in self._now:
                self._now[piece] = self._examined(piece)
            here_in = within & (down == piece[0]) & (along == piece[1])
            found[here_in] = self._now[piece][rows[here_in] % TILE, columns[here_in] % TILE]
        return found

    def _look(self, grid: EvidenceGrid, here: Point) -> None:
        """Copy the map around ``here``."""
        rows, columns = GridFrame(grid.corner, grid.evidence.shape).around((here,), REACH)
        self._evidence = grid.evidence[rows, columns].copy()
        self._first = (grid.first_row + rows.start, grid.first_column + columns.start)
        self._now = {}
        if grid is not self._grid:
            self._before = {}

    def _examined(self, piece: tuple[int, int]) -> NDArray[np.bool_]:
        """Return the narrow cells of one piece (TILE, TILE), with the cells around it that matter.

        It is only examined anew if it shows something else than the last time.
        """
        top, left = (number * TILE - first for number, first in zip(piece, self._first, strict=True))
        rows, columns = (slice(max(0, first - AROUND), first + TILE + AROUND) for first in (top, left))
        shown = np.sign(self._evidence[rows, columns]).astype(np.int8)
        before = self._before.get(piece)
        if before is not None and np.array_equal(before[0], shown):
            return before[1]
        found, whole = np.zeros((TILE, TILE), bool), narrow(shown.astype(np.int16))
        first_row, first_column = top - rows.start, left - columns.start  # of the piece in what is shown
        inner = whole[max(0, first_row) : first_row + TILE, max(0, first_column) : first_column + TILE]
        down, along = max(0, -first_row), max(0, -first_column)
        found[down : down + inner.shape[0], along : along + inner.shape[1]] = inner
        self._before[piece] = shown, found
        return found
