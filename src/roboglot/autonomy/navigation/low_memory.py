"""Remembers, cell by cell, what was seen beside the lidar's plane: no scan can say that it has gone."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.low_sight import LowView
from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.model.geometry import Pose

EXPLAINED = 0.1  # m around an echo within which depth says nothing new

Points = NDArray[np.float64]


class LowMemory:
    """Of one map at a time."""

    def __init__(self) -> None:
        self._grid: EvidenceGrid | None = None
        self._first = (0, 0)
        self._seen: NDArray[np.float32] = np.zeros((0, 0), np.float32)

    def observe(self, grid: EvidenceGrid, view: LowView, echoes: Points, pose: Pose, now: float) -> Points:
        """Note what stands where neither map nor ``echoes`` (map) have anything; returns it in map (n, 2).

        It is forgotten where floor is seen in its place.
        """
        seen = self.seen(grid)
        if seen.any():
            columns, rows = _cells(grid, _placed(view.floor, pose))
            seen[rows, columns] = 0.0
        points = _placed(view.obstacles, pose)
        points = points[_far_from_occupied(grid, points)]
        if len(points) and len(echoes):
            squares = (points[:, None, 0] - echoes[:, 0]) ** 2 + (points[:, None, 1] - echoes[:, 1]) ** 2
            points = points[squares.min(axis=1) > EXPLAINED**2]
        columns, rows = _cells(grid, points)
        seen[rows, columns] = max(now, 1e-3)
        return points

    def seen(self, grid: EvidenceGrid) -> NDArray[np.float32]:
        """When something was seen last in each of the map's cells (s); 0: never."""
        first, shape = (grid.first_row, grid.first_column), grid.evidence.shape
        if grid is self._grid and first == self._first and shape == self._seen.shape:
            return self._seen
        seen = np.zeros(shape, np.float32)
        if grid is self._grid:
            down, along = self._first[0] - first[0], self._first[1] - first[1]
            seen[down : down + self._seen.shape[0], along : along + self._seen.shape[1]] = self._seen
        self._grid, self._first, self._seen = grid, first, seen
        return seen


def _placed(points: Points, pose: Pose) -> Points:
    """Points (n, 2) given in ``pose``, in its frame."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    placed: Points = points @ np.array([[c, s], [-s, c]]) + (pose.x, pose.y)
    return placed


def _cells(grid: EvidenceGrid, points: Points) -> NDArray[np.int64]:
    """Columns and rows (2, n) of those ``points`` (map) that lie on the grid."""
    corner, (height, width) = grid.corner, grid.evidence.shape
    cells = np.floor((points - (corner.x, corner.y)) / RESOLUTION).astype(np.int64)
    inside = ((cells >= 0) & (cells < (width, height))).all(axis=1)
    found: NDArray[np.int64] = cells[inside].T
    return found


def _far_from_occupied(grid: EvidenceGrid, points: Points) -> NDArray[np.bool_]:
    """Which of ``points`` (map) lie on the grid with nothing that the map knows in the cells around."""
    corner, (height, width) = grid.corner, grid.evidence.shape
    columns, rows = np.floor((points - (corner.x, corner.y)) / RESOLUTION).astype(np.int64).T
    far: NDArray[np.bool_] = (rows >= 1) & (columns >= 1) & (rows < height - 1) & (columns < width - 1)
    rows, columns = np.where(far, rows, 1), np.where(far, columns, 1)
    if min(height, width) < 3:
        return far
    for down, along in product((-1, 0, 1), repeat=2):
        far &= grid.evidence[rows + down, columns + along] <= 0
    return far
