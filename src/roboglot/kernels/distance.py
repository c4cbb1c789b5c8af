"""Exact Euclidean distance transform (Felzenszwalb and Huttenlocher 2012), cut off at a cap."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray, SingleArray
from roboglot.kernels.compiled import kernel


@kernel("float32[:,::1](uint8[:,::1], float64)")
def _along_columns(marked: ByteArray, cap: float) -> SingleArray:
    """Distance in cells to the nearest marked cell of the same column, ``cap`` at most: down, then up."""
    height, width = marked.shape
    away = np.empty((height, width), np.float32)
    column = np.empty(width, np.float32)
    for col in range(width):
        column[col] = np.float32(cap)
    for row in range(height):
        for col in range(width):
            column[col] = (
                np.float32(0.0) if marked[row, col] != 0 else min(column[col] + np.float32(1.0), np.float32(cap))
            )
            away[row, col] = column[col]
    for col in range(width):
        column[col] = np.float32(cap)
    for row in range(height - 1, -1, -1):
        for col in range(width):
            column[col] = min(away[row, col], column[col] + np.float32(1.0))
            away[row, col] = column[col]
    return away


@kernel("float32[:,::1](uint8[:,::1], float64)")
def distances(marked: ByteArray, cap: float) -> SingleArray:
    """Distance in cells from each cell's centre to the nearest cell with ``marked`` != 0; ``cap`` where farther."""
    away = _along_columns(marked, cap)
    height, width = away.shape
    limit, column = np.float32(cap * cap), np.empty(width, np.float32)
    place = np.empty(width, np.int64)  # columns of the parabolas in the lower envelope
    border = np.empty(width + 1, np.float64)  # boundaries between neighbouring parabolas
    for row in range(height):
        count = 0
        for col in range(width):
            own = np.float64(away[row, col])
            if own >= cap:
                continue
            own = own * own
            start = -np.inf
            while count > 0:
                last = place[count - 1]
                before = np.float64(away[row, last])
                start = (own + col * col - before * before - last * last) / (2.0 * (col - last))
                if start > border[count - 1]:
                    break
                count -= 1
                start = -np.inf
            place[count] = col
            border[count] = start
            count += 1
        border[count] = np.inf
        # The row's own values are needed until the sweep is complete.
        current = 0
        for col in range(width):
            if count == 0:
                column[col] = limit
                continue
            while border[current + 1] < col:
                current += 1
            across = np.float64(col - place[current])
            up = np.float64(away[row, place[current]])
            column[col] = min(limit, np.float32(across * across + up * up))
        for col in range(width):
            away[row, col] = np.sqrt(column[col])
    return away
