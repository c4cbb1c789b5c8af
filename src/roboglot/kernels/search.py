"""Shortest paths on a cost grid: A*, 8-connected, optimal, the same result every time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

DIAGONAL = np.sqrt(2.0)


@njit(cache=True, nogil=True)
def _trace(came: Any, closed: Any, start: int, goal: int, width: int) -> Any:
    """The cells from start to goal, or none."""
    if not closed[goal]:
        return np.empty((0, 2), np.int32)
    count, cell = 1, goal
    while cell != start:
        cell = came[cell]
        count += 1
    path = np.empty((count, 2), np.int32)
    cell = goal
    for i in range(count - 1, -1, -1):
        path[i, 0], path[i, 1] = cell // width, cell % width
        cell = came[cell]
    return path


@njit("float64(int64, int64)", cache=True, nogil=True)
def _least_cost(rows: int, columns: int) -> Any:
    """What the way over so many rows and columns costs at least: octile distance on open floor."""
    return max(rows, columns) + (DIAGONAL - 1.0) * min(rows, columns)


@njit(cache=True, nogil=True)
def _push(keys: Any, cells: Any, size: int, key: float, cell: int) -> None:
    """Add to the heap of ``size`` entries."""
    at = size
    while at > 0:
        above = (at - 1) // 2
        if keys[above] < key or (keys[above] == key and cells[above] <= cell):
            break
        keys[at], cells[at] = keys[above], cells[above]
        at = above
    keys[at], cells[at] = key, cell


@njit(cache=True, nogil=True)
def _sift_down(keys: Any, cells: Any, size: int) -> None:
    """Move the entry at ``size`` into the empty root of a heap of ``size`` entries."""
    if size == 0:
        return
    key, cell, at = keys[size], cells[size], 0
    while True:
        below = 2 * at + 1
        if below >= size:
            break
        if below + 1 < size and (
            keys[below + 1] < keys[below] or (keys[below + 1] == keys[below] and cells[below + 1] < cells[below])
        ):
            below += 1
        if key < keys[below] or (key == keys[below] and cell <= cells[below]):
            break
        keys[at], cells[at] = keys[below], cells[below]
        at = below
    keys[at], cells[at] = key, cell


@njit("int32[:,::1](float32[:,::1], int64, int64, int64, int64)", cache=True, nogil=True)
def shortest_path(cost: Any, start_row: int, start_col: int, goal_row: int, goal_col: int) -> Any:
    """Cells (row, column) from start to goal with the least cost; no cell if there is no way.

    A step costs its length in cells times the mean ``cost`` (>= 1, inf: closed) of its two cells; diagonal steps need
    both cells beside them open. Ties are broken by the cell's number.
    """
    height, width = cost.shape
    start, goal = start_row * width + start_col, goal_row * width + goal_col
    came = np.full(height * width, -1, np.int32)
    if not (np.isfinite(cost[start_row, start_col]) and np.isfinite(cost[goal_row, goal_col])):
        return np.empty((0, 2), np.int32)
    so_far = np.full(height * width, np.inf, np.float64)
    closed = np.zeros(height * width, np.uint8)
    keys, cells = np.empty(1024, np.float64), np.empty(1024, np.int32)  # a binary heap
    size, keys[0], cells[0], so_far[start] = 1, 0.0, start, 0.0
    while size > 0:
        cell, size = cells[0], size - 1
        _sift_down(keys, cells, size)
        if closed[cell]:
            continue
        closed[cell] = 1
        if cell == goal:
            break
        row, col = cell // width, cell % width
        here = cost[row, col]
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                r, c = row + dr, col + dc
                if (dr == 0 and dc == 0) or r < 0 or c < 0 or r >= height or c >= width:
                    continue
                there = cost[r, c]
                if not np.isfinite(there):
                    continue
                slanting = dr != 0 and dc != 0
                if slanting and not (np.isfinite(cost[row, c]) and np.isfinite(cost[r, col])):
                    continue
                length = DIAGONAL if slanting else 1.0
                other = r * width + c
                value = so_far[cell] + length * 0.5 * (here + there)
                if closed[other] or value >= so_far[other]:
                    continue
                so_far[other] = value
                came[other] = cell
                if size == keys.shape[0]:
                    keys = np.concatenate((keys, np.empty(size, np.float64)))
                    cells = np.concatenate((cells, np.empty(size, np.int32)))
                _push(keys, cells, size, value + _least_cost(abs(r - goal_row), abs(c - goal_col)), other)
                size += 1
    return _trace(came, closed, start, goal, width)
