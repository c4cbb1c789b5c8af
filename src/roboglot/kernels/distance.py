"""Distances in a grid: the exact Euclidean transform, cut off at a cap; and straight on, for gaps between obstacles.

And between a robot's way and another's; cells beside a line.

Near ones are compared one by one in wide instructions, far ones by parabolas (Felzenszwalb and Huttenlocher 2012): the
same to the last bit, since squares of whole cells are exact.
"""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import BoolArray, ByteArray, FloatArray, IntArray, SingleArray
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


@kernel("void(boolean[:,::1], float64[:,::1], float64, float64, float64, float64)")
def mark_beside(mask: BoolArray, way: FloatArray, left: float, bottom: float, resolution: float, reach: float) -> None:
    """Mark the cells whose centre lies within ``reach`` of a polyline (n, 2; m).

    ``left``, ``bottom``: the corner of cell (0, 0), m.
    """
    height, width = mask.shape
    for i in range(len(way) - 1):
        ax, ay, bx, by = way[i, 0], way[i, 1], way[i + 1, 0], way[i + 1, 1]
        dx, dy = bx - ax, by - ay
        square = max(dx * dx + dy * dy, 1e-12)
        low, high = (min(ay, by) - reach - bottom) / resolution, (max(ay, by) + reach - bottom) / resolution
        for row in range(int(max(0.0, min(low, height))), int(max(0.0, min(high + 1.0, height)))):
            y = bottom + (row + 0.5) * resolution
            first, last = 0.0, 1.0  # shares of the piece that may be near this row
            if dy != 0.0:
                one, other = (y - reach - ay) / dy, (y + reach - ay) / dy
                first, last = max(0.0, min(one, other)), min(1.0, max(one, other))
            one, other = ax + first * dx, ax + last * dx
            near, far = (min(one, other) - reach - left) / resolution, (max(one, other) + reach - left) / resolution
            for col in range(int(max(0.0, min(near - 1.0, width))), int(max(0.0, min(far + 2.0, width)))):
                x = left + (col + 0.5) * resolution
                share = min(1.0, max(0.0, ((x - ax) * dx + (y - ay) * dy) / square))
                if np.hypot(x - ax - share * dx, y - ay - share * dy) <= reach:
                    mask[row, col] = True


@kernel("void(boolean[:,::1], float64[::1], float64[::1], float64, float64, float64, float64)")
def mark_inside(
    mask: BoolArray, start: FloatArray, end: FloatArray, half: float, left: float, bottom: float, resolution: float
) -> None:
    """Mark the cells whose centre lies in a rectangle, ``half`` m to both sides of its centre line; see above."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = np.hypot(dx, dy)
    if length == 0.0:
        return
    ux, uy = dx / length, dy / length
    for row in range(mask.shape[0]):
        y = bottom + (row + 0.5) * resolution - start[1]
        for col in range(mask.shape[1]):
            x = left + (col + 0.5) * resolution - start[0]
            along, beside = x * ux + y * uy, y * ux - x * uy
            mask[row, col] |= (along >= 0.0) & (along <= length) & (abs(beside) <= half)


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


@kernel("uint8[::1](uint8[:,::1], float64[:,::1], int64, int64, float64, uint8)")
def kinds_at(cells: ByteArray, points: FloatArray, row: int, col: int, resolution: float, off: int) -> ByteArray:
    """Return the value of the cell under each of ``points`` (n, 2; m); ``off`` outside of the grid.

    The first of the ``cells`` is at (row, col), counted from the origin of the points' frame.
    """
    (height, width), found = cells.shape, np.empty(points.shape[0], np.uint8)
    for i in range(points.shape[0]):
        r, c = int(np.floor(points[i, 1] / resolution)) - row, int(np.floor(points[i, 0] / resolution)) - col
        found[i] = cells[r, c] if 0 <= r < height and 0 <= c < width else off
    return found


@kernel("void(boolean[::1], int64)")
def join(marked: BoolArray, longest: int) -> None:
    """Mark what lies between two marked places up to ``longest`` apart."""
    last = -1
    for i in range(len(marked)):
        if marked[i]:
            for k in range(last + 1, i if last >= 0 and i - last <= longest else 0):
                marked[k] = True
            last = i


@kernel("float64[:,::1](float64[:,::1])")
def directions(way: FloatArray) -> FloatArray:
    """Return unit vectors along a way (n, 2), from each point to the next; the last is as the one before."""
    found, last = np.zeros(way.shape), len(way) - 1
    for i in range(last + 1 if last > 0 else 0):
        k = min(i, last - 1)
        x, y = way[k + 1, 0] - way[k, 0], way[k + 1, 1] - way[k, 1]
        length = max(np.hypot(x, y), 1e-6)
        found[i, 0], found[i, 1] = x / length, y / length
    return found


@kernel("boolean[:,::1](float64[:,::1], float64[:,::1], float64, float64)")
def facing(path: FloatArray, way: FloatArray, reach: float, alike: float) -> BoolArray:
    """Return which points of ``path`` (n, 2; m) lie within ``reach`` of those of ``way`` (k, 2; m) and lead elsewhere.

    That is, the cosine of the angle between the two directions is less than ``alike``.
    """
    found, ahead, its = np.zeros((len(path), len(way)), np.bool_), directions(path), directions(way)
    for i in range(len(path)):
        for j in range(len(way)):
            if np.hypot(path[i, 0] - way[j, 0], path[i, 1] - way[j, 1]) < reach:
                found[i, j] = ahead[i, 0] * its[j, 0] + ahead[i, 1] * its[j, 1] < alike
    return found


@kernel("int64(float64[:,::1], float64[:,::1], float64, float64, float64, float64)")
def meets_mover(path: FloatArray, way: FloatArray, stops: float, x: float, y: float, reach: float) -> int:
    """Return the first point of ``path`` (n, 2; m) within ``reach`` of a mover's ``way`` (k, 2; m); -1: none is.

    The way counts up to ``stops`` m. What a robot at (x, y) moves away from does not count.
    """
    spots, count, along = np.empty((len(way), 2)), 0, 0.0
    for j in range(len(way)):
        step = np.hypot(way[j, 0] - way[j - 1, 0], way[j, 1] - way[j - 1, 1]) if j > 0 else 0.0
        share = min(1.0, (stops - along) / step) if step > 0.0 else 1.0
        if share <= 0.0:
            break
        before = max(0, j - 1)
        spots[count, 0] = way[before, 0] + share * (way[j, 0] - way[before, 0])
        spots[count, 1] = way[before, 1] + share * (way[j, 1] - way[before, 1])
        along, count = along + step, count + 1
    for i in range(len(path) if count > 1 else 0):
        for j in range(count):
            away = np.hypot(path[i, 0] - spots[j, 0], path[i, 1] - spots[j, 1])
            if away < reach and away < np.hypot(spots[j, 0] - x, spots[j, 1] - y) - 0.01:
                return i
    return -1
