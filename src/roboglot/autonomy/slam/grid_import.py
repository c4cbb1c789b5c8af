"""Import of a grid (from a file, another robot) into the arrays of localization and mapping.

A grid does not have the surfaces' places in its cells, nor the sides they face: they are assumed in the cells' middle,
facing free floor. Both improve with the first scans.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import CELLS_MAX, GRID_MAX, PER_STEP, RESOLUTION, EvidenceGrid, is_too_large
from roboglot.model.errors import InvalidGoal
from roboglot.model.maps import OccupancyGrid

HITS = 3.0  # weight of an imported surface, in hits of the lidar
SAME = 1e-4  # relative difference of resolutions that count as equal: files use single precision


def evidence_of(grid: OccupancyGrid) -> EvidenceGrid:
    """Return ``grid`` resampled to the map's cells. Raises InvalidGoal if it is too large or has no place."""
    imported = EvidenceGrid()
    known = grid.trimmed()
    if not known.width:
        return imported
    cells, imported.first_row, imported.first_column = _resampled(known)
    steps = np.abs(cells.astype(np.int16))
    imported.evidence = (np.sign(cells) * ((steps - 1) * PER_STEP + PER_STEP // 2)).astype(np.int16)
    imported.evidence[cells == 0] = 0
    imported.surfaces, imported.slots = _surfaces(cells)
    imported.used, imported.marks = len(imported.surfaces), np.zeros(cells.shape, np.int16)
    imported.scans = 1  # so that the map does not count as empty
    return imported


def _resampled(grid: OccupancyGrid) -> tuple[NDArray[np.int8], int, int]:
    """Return cells of RESOLUTION, and row and column of the first, from the origin. Raises InvalidGoal."""
    finer = RESOLUTION / grid.resolution
    row, column = grid.origin.y / RESOLUTION, grid.origin.x / RESOLUTION
    if not all(map(math.isfinite, (row, column, finer))) or finer <= 0.0:
        raise InvalidGoal("the map has no place")
    height, width = (max(1, math.ceil(side / finer - SAME)) for side in (grid.height, grid.width))
    if is_too_large(height, width):
        raise InvalidGoal(f"a map has at most {CELLS_MAX * RESOLUTION**2:,.0f} m2, {GRID_MAX * RESOLUTION:g} m a side")
    if abs(finer - 1.0) < SAME:
        return grid.log_odds, round(row), round(column)
    if finer < 1.0:
        rows, columns = (
            np.minimum(((np.arange(n) + 0.5) * finer).astype(int), most - 1)
            for n, most in ((height, grid.height), (width, grid.width))
        )
        return grid.log_odds[np.ix_(rows, columns)], round(row), round(column)
    (rows, to_rows), (columns, to_columns) = (
        _groups(np.minimum((np.arange(n) / finer).astype(int), most - 1))
        for n, most in ((grid.height, height), (grid.width, width))
    )
    occupied = np.maximum.reduceat(np.maximum.reduceat(grid.log_odds, rows, axis=0), columns, axis=1)
    free = np.minimum.reduceat(np.minimum.reduceat(grid.log_odds, rows, axis=0), columns, axis=1)
    cells = np.zeros((height, width), np.int8)
    cells[np.ix_(to_rows, to_columns)] = np.where(occupied > 0, occupied, free)
    return cells, round(row), round(column)


def _groups(ascending: NDArray[np.int_]) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return where each run of equal numbers begins, and its number."""
    begins = np.flatnonzero(np.diff(ascending, prepend=-1))
    return begins, ascending[begins]


def _surfaces(cells: NDArray[np.int8]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return the surfaces with the sides that they face, and their slots, in the form of ``kernels.occupancy``."""
    free = np.pad(cells < 0, 1)
    rows, columns = np.nonzero(cells > 0)
    count = len(rows)
    towards_x, towards_y = np.zeros((2, count), np.float32)
    for down in (-1, 0, 1):
        for along in (-1, 0, 1):
            if down or along:
                there = free[rows + 1 + down, columns + 1 + along].astype(np.float32) / math.hypot(down, along)
                towards_x += along * there
                towards_y += down * there
    length = np.maximum(np.hypot(towards_x, towards_y), 1.0)  # a thin wall is seen from both sides
    surfaces, slots = np.zeros((1 + count, 5), np.float32), np.zeros(cells.shape, np.int32)
    slots[rows, columns] = np.arange(1, 1 + count)
    surfaces[1:, 0] = HITS
    surfaces[1:, 1] = surfaces[1:, 2] = HITS * RESOLUTION / 2
    surfaces[1:, 3] = HITS * (towards_x / length)
    surfaces[1:, 4] = HITS * (towards_y / length)
    return surfaces, slots
