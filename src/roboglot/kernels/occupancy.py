"""An occupancy grid from laser scans: evidence per cell, and where within the cell the surface lies.

Arrays: ``evidence`` int16 (rows along y, columns along x; 0 unknown, below free, above occupied); ``surface`` float32
(rows, columns, 5): number of hits, their summed x and y (m, from the cell's corner) and the summed unit vector from
the hits towards the sensor; ``marks`` int32: the number of the last scan that touched the cell.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

HIT = 100
MISS = -35
EVIDENCE_MAX = 2000
EVIDENCE_MIN = -1200
HITS_MAX = 5000.0


@njit(cache=True, nogil=True)
def _clear_ray(
    evidence: Any, marks: Any, scan: int, end_x: float, end_y: float, x: float, y: float, resolution: float
) -> None:
    """Walk the cells from (x, y) until one and a half cells before the end, and lower their evidence."""
    height, width = evidence.shape
    dx, dy = end_x - x, end_y - y
    length = np.sqrt(dx * dx + dy * dy)
    if length <= 0.0:
        return
    dx, dy = dx / length, dy / length
    last = (length - 1.5 * resolution) / resolution
    col, row = int(np.floor(x / resolution)), int(np.floor(y / resolution))
    step_col, step_row = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    per_col = 1.0 / abs(dx) if dx != 0 else np.inf
    per_row = 1.0 / abs(dy) if dy != 0 else np.inf
    cell_x, cell_y = x / resolution, y / resolution
    next_col = ((col + 1 - cell_x) if dx > 0 else (cell_x - col)) * per_col if dx != 0 else np.inf
    next_row = ((row + 1 - cell_y) if dy > 0 else (cell_y - row)) * per_row if dy != 0 else np.inf
    gone = 0.0
    while gone < last:
        if row < 0 or col < 0 or row >= height or col >= width:
            return
        if marks[row, col] != scan:
            marks[row, col] = scan
            value = max(EVIDENCE_MIN, evidence[row, col] + MISS)
            evidence[row, col] = value if value != 0 else -1
        if next_col < next_row:
            gone = next_col
            next_col += per_col
            col += step_col
        else:
            gone = next_row
            next_row += per_row
            row += step_row


@njit(
    "void(int16[:,::1], float32[:,:,::1], int32[:,::1], int64, float64[:,::1], uint8[::1], float64, float64, float64)",
    cache=True,
    nogil=True,
)
def integrate(
    evidence: Any, surface: Any, marks: Any, scan: int, ends: Any, hit: Any, x: float, y: float, resolution: float
) -> None:
    """Add one scan taken at (x, y): ``ends`` are the rays' ends, occupied where ``hit``; metres from the grid's corner.

    A cell changes once per scan at most, and a hit wins over rays that pass. Ends outside the grid are clipped.
    """
    height, width = evidence.shape
    for i in range(ends.shape[0]):
        if hit[i] == 0:
            continue
        col = int(np.floor(ends[i, 0] / resolution))
        row = int(np.floor(ends[i, 1] / resolution))
        if row < 0 or col < 0 or row >= height or col >= width:
            continue
        if marks[row, col] != scan:
            marks[row, col] = scan
            if evidence[row, col] <= 0:  # what was there before is gone
                surface[row, col, :] = 0.0
            evidence[row, col] = min(EVIDENCE_MAX, evidence[row, col] + HIT)
            if evidence[row, col] == 0:
                evidence[row, col] = 1
        if surface[row, col, 0] < HITS_MAX:
            dx, dy = x - ends[i, 0], y - ends[i, 1]
            away = np.sqrt(dx * dx + dy * dy)
            surface[row, col, 0] += 1.0
            surface[row, col, 1] += ends[i, 0] - col * resolution
            surface[row, col, 2] += ends[i, 1] - row * resolution
            surface[row, col, 3] += dx / away
            surface[row, col, 4] += dy / away
    for i in range(ends.shape[0]):
        _clear_ray(evidence, marks, scan, ends[i, 0], ends[i, 1], x, y, resolution)
