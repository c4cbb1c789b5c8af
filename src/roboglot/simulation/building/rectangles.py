"""Covers the set cells of a boolean grid with few rectangles, exactly. Arrays only; knows no map and no world."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Rectangle = tuple[int, int, int, int]  # first row, first column, rows, columns


def cover(cells: NDArray[np.bool_]) -> list[Rectangle]:
    """Return disjoint rectangles that exactly cover the set cells: the fewer of two, grown by rows or columns first."""
    along_rows = _grow(cells)
    along_columns = [(column, row, columns, rows) for row, column, rows, columns in _grow(cells.T)]
    return min(along_rows, along_columns, key=len)


def _grow(cells: NDArray[np.bool_]) -> list[Rectangle]:
    """Return rectangles by a greedy search: each uncovered run of a row grows over the next rows while they are set."""
    left = cells.copy()
    found: list[Rectangle] = []
    for row in range(left.shape[0]):
        for first, end in _runs(left[row]):
            rows = 1
            while row + rows < left.shape[0] and left[row + rows, first:end].all():
                rows += 1
            left[row : row + rows, first:end] = False
            found.append((row, first, rows, end - first))
    return found


def _runs(line: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return [begin, end) of every run of set cells."""
    edges = np.flatnonzero(np.diff(line.astype(np.int8), prepend=0, append=0))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
