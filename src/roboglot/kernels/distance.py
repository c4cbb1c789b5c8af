"""Distances in a grid: the exact Euclidean transform, cut off at a cap; and straight on, for gaps between obstacles.

Near ones are compared one by one in wide instructions, far ones by parabolas (Felzenszwalb and Huttenlocher 2012): the
same to the last bit, since squares of whole cells are exact.
"""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray, IntArray, SingleArray
from roboglot.kernels.compiled import kernel

NEAR_MAX = 24  # cells of a cap up to which comparing one by one is quicker


@kernel("float32[:,::1](uint8[:,::1], float64)")
def _along_columns(marked: ByteArray, cap: float) -> SingleArray:
    """Fill in the distance in cells to the nearest marked cell of the same column, at most ``cap``: down, then up."""
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


@kernel("void(float32[::1], float32[::1], float32[::1], float32)")
def _lower(left: SingleArray, right: SingleArray, found: SingleArray, across: np.float32) -> None:
    """Lower ``found`` to the lesser of the two plus ``across``: a loop of its own, which becomes wide instructions."""
    for col in range(found.shape[0]):
        found[col] = min(found[col], min(left[col], right[col]) + across)


@kernel("void(float32[::1], float64, float32[::1], float32[::1])")
def _nearest(row: SingleArray, cap: float, squares: SingleArray, found: SingleArray) -> None:
    """Fill ``found`` with the squared distances of one row, whose cells have those of their columns.

    ``squares`` has room for ``cap`` cells more at both ends.
    """
    width, reach, limit = len(row), int(cap), np.float32(cap * cap)
    for col in range(len(squares)):
        squares[np.uintp(col)] = limit
    for col in range(width):
        own = np.float64(row[np.uintp(col)])
        squares[np.uintp(reach + col)] = min(limit, np.float32(own * own))
        found[np.uintp(col)] = squares[np.uintp(reach + col)]
    for aside in range(1, reach + 1):
        left, right = squares[reach - aside : reach - aside + width], squares[reach + aside : reach + aside + width]
        _lower(left, right, found, np.float32(aside * aside))


@kernel("float32[:,::1](uint8[:,::1], float64)")
def distances(marked: ByteArray, cap: float) -> SingleArray:
    """Distance in cells from each cell's centre to the nearest cell with ``marked`` != 0; ``cap`` where farther."""
    away = _along_columns(marked, cap)
    height, width = away.shape
    limit, column = np.float32(cap * cap), np.empty(width, np.float32)
    if cap <= NEAR_MAX:
        squares = np.empty(width + 2 * int(cap), np.float32)
        for row in range(height):
            _nearest(away[row], cap, squares, column)
            for col in range(width):
                away[row, col] = np.sqrt(column[col])
        return away
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


@kernel("void(uint8[::1], float32[::1], float32[::1], float32)")
def _one_farther(occupied: ByteArray, there: SingleArray, found: SingleArray, far: np.float32) -> None:
    """Fill one row with a cell more than ``there``, or 0 where that is occupied: in wide instructions."""
    for col in range(found.shape[0]):
        found[col] = np.float32(0.0) if occupied[col] != 0 else min(far, there[col] + np.float32(1.0))


@kernel("void(uint8[:,::1], int64, int64, int64, float32[:,::1])")
def free_cells(occupied: ByteArray, down: int, along: int, far: int, found: SingleArray) -> None:
    """Fill in how many cells, ``far`` at most, lie between each cell and the next occupied one that way.

    Nothing is occupied outside of the grid.
    """
    (height, width), most = occupied.shape, np.float32(far)
    first, end = min(width, max(0, -along)), max(0, min(width, width - along))  # columns with a neighbour that way
    for i in range(height):
        row = height - 1 - i if down > 0 else i
        r = row + down
        inside = 0 <= r < height and first < end
        for col in range(first if inside else width):
            found[row, col] = most
        if not inside:
            continue
        for col in range(end, width):
            found[row, col] = most
        if down != 0:
            _one_farther(
                occupied[r, first + along : end + along],
                found[r, first + along : end + along],
                found[row, first:end],
                most,
            )
            continue
        for j in range(end - first):
            col = end - 1 - j if along > 0 else first + j
            free = min(most, found[r, col + along] + np.float32(1.0))
            found[row, col] = np.float32(0.0) if occupied[r, col + along] != 0 else free


@kernel("void(float32[::1], float32[::1], float32[::1], float32[::1], float64, float64, float64, uint8[::1])")
def _mark_gaps(
    ahead: SingleArray,
    behind: SingleArray,
    aside: SingleArray,
    beside: SingleArray,
    step: float,
    wide: float,
    deep: float,
    found: ByteArray,
) -> None:
    """Mark the cells of one row that lie in a gap along an axis, or across it: in wide instructions."""
    for col in range(found.shape[0]):
        narrow = (np.float64(ahead[col] + behind[col]) + 1.0) * step < wide
        narrow_across = (np.float64(aside[col] + beside[col]) + 1.0) * step < wide
        through = np.float64(min(aside[col], beside[col])) * step >= deep
        through_across = np.float64(min(ahead[col], behind[col])) * step >= deep
        found[col] |= (narrow & through) | (narrow_across & through_across)


@kernel("uint8[:,::1](uint8[:,::1], int64[:,::1], float64, float64)")
def gaps(occupied: ByteArray, axes: IntArray, wide: float, deep: float) -> ByteArray:
    """Return 1 for cells between two obstacles less than ``wide`` apart, with ``deep`` cells free before and behind.

    Measured along ``axes`` (n, 2: cells down and along), and across each of them.
    """
    height, width = occupied.shape
    found = np.zeros((height, width), np.uint8)
    one, other = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    left, right = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    for k in range(len(axes)):
        down, along = axes[k, 0], axes[k, 1]
        step = np.sqrt(np.float64(down * down + along * along))
        far = int(np.ceil(wide / step))
        free_cells(occupied, down, along, far, one)
        free_cells(occupied, -down, -along, far, other)
        free_cells(occupied, along, -down, far, left)
        free_cells(occupied, -along, down, far, right)
        for row in range(height):
            _mark_gaps(one[row], other[row], left[row], right[row], step, wide, deep, found[row])
    return found
