"""Costs of cells by what stands around them; shortest paths: A*, 8-connected, optimal, always the same; their corners.

The open cells wait in buckets of nearly equal estimates instead of a heap, last in first out. A cell may be taken up
again when a cheaper way to it turns up within its bucket; the search ends when no bucket can beat the goal's cost.
"""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray, Int8Array, Int16Array, Int32Array, IntArray, SingleArray
from roboglot.kernels.compiled import kernel
from roboglot.kernels.distance import distances

DIAGONAL = np.sqrt(2.0)
BUCKET = 0.05  # of cost per bucket: cells are rarely expanded twice
BUCKETS = 4096  # in a ring
ENTRIES = 65_536  # initial capacity for waiting cells; grows
SIGHT_MAX = 160  # cells of path that one straight line may replace
STEP = 0.5  # cells between two samples of a line


@kernel("int32[:,::1](int8[::1], int64, int64, int64)")
def _trace(came: Int8Array, start: int, goal: int, width: int) -> Int32Array:
    """Return the cells from start to goal; ``came`` holds the step (0-8) by which each was reached."""
    count, cell = 1, goal
    while cell != start:
        step = came[cell]
        cell -= (step // 3 - 1) * width + step % 3 - 1
        count += 1
    path = np.empty((count, 2), np.int32)
    cell = goal
    for i in range(count - 1, -1, -1):
        path[i, 0], path[i, 1] = cell // width, cell % width
        step = came[cell]
        if i > 0:
            cell -= (step // 3 - 1) * width + step % 3 - 1
    return path


@kernel("float64(int64, int64)")
def _least_cost(rows: int, columns: int) -> float:
    """Return the least cost of a path across this many rows and columns: octile distance on open floor."""
    rows, columns = abs(rows), abs(columns)
    return float(max(rows, columns) + (DIAGONAL - 1.0) * min(rows, columns))


@kernel(
    "boolean(float32[:,::1], int64, int64, int64, int64, float32[::1], int8[::1])",
)
def _search(
    cost: SingleArray, start_row: int, start_col: int, goal_row: int, goal_col: int, paid: SingleArray, came: Int8Array
) -> bool:
    """Fill ``paid`` (1 + cost; 0: not reached) and ``came`` until the goal's are final; True if it was reached."""
    height, width = cost.shape
    ground, goal = cost.ravel(), goal_row * width + goal_col
    # The waiting cells: index, cost, and the next entry in the same bucket (or in the free list).
    places, asked, below = np.empty(ENTRIES, np.int32), np.empty(ENTRIES, np.float32), np.empty(ENTRIES, np.int32)
    heads = np.empty(BUCKETS, np.int32)
    for place in range(BUCKETS):
        heads[place] = -1
    heads[0], places[0], asked[0], below[0] = 0, (start_row << 16) | start_col, 1.0, -1
    spare, used, waiting, level, paid[start_row * width + start_col] = -1, 1, 1, 0, 1.0
    least, scale = _least_cost(start_row - goal_row, start_col - goal_col), 1.0 / BUCKET
    around = np.array((-width, -1, 1, width, -width - 1, -width + 1, width - 1, width + 1), np.int64)
    steps, opens = np.array((1, 3, 5, 7, 0, 2, 6, 8), np.int8), np.empty(8, np.bool_)
    downs, rights = np.array((-1, 0, 0, 1, -1, -1, 1, 1)), np.array((0, -1, 1, 0, -1, 1, -1, 1))
    while waiting > 0:
        entry = heads[level & (BUCKETS - 1)]
        if entry < 0:
            level += 1
            if paid[goal] > 0.0 and paid[goal] - 1.0 <= least + level * BUCKET:
                return True
            continue
        row, col = np.int64(places[entry] >> 16), np.int64(places[entry] & 65535)
        heads[level & (BUCKETS - 1)], below[entry], waiting, spare = below[entry], spare, waiting - 1, entry
        cell, so_far = row * width + col, asked[entry]
        if so_far > paid[cell]:
            continue
        half = np.float32(0.5) * ground[cell]
        up, down = row > 0 and ground[cell - width] < np.inf, row < height - 1 and ground[cell + width] < np.inf
        left, right = col > 0 and ground[cell - 1] < np.inf, col < width - 1 and ground[cell + 1] < np.inf
        opens[0], opens[1], opens[2], opens[3], opens[4] = up, left, right, down, up & left
        opens[5], opens[6], opens[7] = up & right, down & left, down & right
        for k in range(8):
            if not opens[k]:
                continue
            other = cell + around[k]
            value = half + np.float32(0.5) * ground[other]
            value = so_far + (value if k < 4 else np.float32(DIAGONAL) * value)
            if (paid[other] != 0.0 and value >= paid[other]) or value == np.inf:
                continue
            paid[other], came[other] = value, steps[k]
            r, c = row + downs[k], col + rights[k]
            estimate = value - 1.0 + _least_cost(r - goal_row, c - goal_col)
            # Entries beyond the ring are examined early only if necessary.
            place = (level + min(max(int((estimate - least) * scale) - level, 0), BUCKETS - 1)) & (BUCKETS - 1)
            if spare >= 0:
                fresh, spare = spare, below[spare]
            else:
                fresh, used = used, used + 1
                if fresh == places.shape[0]:
                    old_places, old_asked, old_below = places, asked, below
                    places, below = np.empty(2 * fresh, np.int32), np.empty(2 * fresh, np.int32)
                    asked = np.empty(2 * fresh, np.float32)
                    for i in range(fresh):
                        places[i], asked[i], below[i] = old_places[i], old_asked[i], old_below[i]
            places[fresh], asked[fresh], below[fresh] = (r << 16) | c, value, heads[place]
            heads[place], waiting = fresh, waiting + 1
    return bool(paid[goal] > 0.0)


def shortest_path(cost: SingleArray, start_row: int, start_col: int, goal_row: int, goal_col: int) -> Int32Array:
    """Cells (row, column; int32) from start to goal with the least cost; no cell if there is no way.

    A step costs its length in cells times the mean ``cost`` (float32, >= 1, inf: closed) of its two cells; diagonal
    steps need both cells beside them open.
    """
    height, width = cost.shape
    if not (np.isfinite(cost[start_row, start_col]) and np.isfinite(cost[goal_row, goal_col])):
        return np.empty((0, 2), np.int32)
    # Zeroed pages cost nothing until touched.
    paid, came = np.zeros(height * width, np.float32), np.zeros(height * width, np.int8)
    if not _search(cost, start_row, start_col, goal_row, goal_col, paid, came):
        return np.empty((0, 2), np.int32)
    return _trace(came, start_row * width + start_col, goal_row * width + goal_col, width)


def ways_from(cost: SingleArray, row: int, col: int) -> SingleArray:
    """Return the cost of the cheapest way to each cell (float32, shape of ``cost``); inf: there is none."""
    height, width = cost.shape
    # The goal is below the grid, out of reach: the search ends when every cell has been visited.
    paid, came = np.zeros((height + 1) * width, np.float32), np.zeros(height * width, np.int8)
    if np.isfinite(cost[row, col]):
        _search(cost, row, col, height, 0, paid, came)
    found = paid[: height * width].reshape(height, width)
    return np.where(found > 0.0, found - np.float32(1.0), np.float32(np.inf))


@kernel("float64(float32[:,::1], float64, float64, float64, float64)")
def line_cost(cost: SingleArray, row0: float, col0: float, row1: float, col1: float) -> float:
    """Cost of the straight line between two points (in cells; a cell's centre has whole numbers); inf if closed."""
    length = np.sqrt((row1 - row0) ** 2 + (col1 - col0) ** 2)
    count = max(1, int(np.ceil(length / STEP)))
    total = 0.0
    for i in range(count + 1):
        share = i / count
        value = cost[int(np.rint(row0 + share * (row1 - row0))), int(np.rint(col0 + share * (col1 - col0)))]
        if not np.isfinite(value):
            return np.inf
        total += value * (0.5 if i == 0 or i == count else 1.0)
    return float(total * length / count)


@kernel("int32[::1](float32[:,::1], int32[:,::1], float64)")
def corners(cost: SingleArray, path: Int32Array, slack: float) -> Int32Array:
    """Indices of the cells of ``path`` to keep: between two of them the line costs at most ``slack`` times the path."""
    count = path.shape[0]
    kept = np.empty(max(count, 1), np.int32)
    if count == 0:
        return kept[:0].copy()
    along = np.zeros(count)
    for i in range(1, count):
        along[i] = along[i - 1] + line_cost(cost, path[i - 1, 0], path[i - 1, 1], path[i, 0], path[i, 1])
    kept[0] = 0
    number, at = 1, 0
    while at < count - 1:
        following = at + 1
        for other in range(min(count - 1, at + SIGHT_MAX), at + 1, -1):
            straight = line_cost(cost, path[at, 0], path[at, 1], path[other, 0], path[other, 1])
            if straight <= slack * (along[other] - along[at]):
                following = other
                break
        kept[number] = following
        number += 1
        at = following
    return kept[:number].copy()


@kernel("int64[::1](float32[:,::1], float64, float64, float64)")
def nearest_open(cost: SingleArray, row: float, col: float, reach: float) -> IntArray:
    """(row, column) of the open cell whose centre is nearest to a place and within ``reach`` of it, all in cells.

    ``row`` and ``col`` count from the grid's corner, so that a cell's centre lies at halves. Empty: all are closed.
    """
    height, width = cost.shape
    best, found = reach * reach, np.empty(0, np.int64)
    for r in range(max(0, int(np.floor(row - reach))), min(height, int(np.ceil(row + reach)))):
        for c in range(max(0, int(np.floor(col - reach))), min(width, int(np.ceil(col + reach)))):
            away = (r + 0.5 - row) ** 2 + (c + 0.5 - col) ** 2
            if away <= best and np.isfinite(cost[r, c]) and (len(found) == 0 or away < best):
                best = away
                found = np.array([r, c], np.int64)
    return found


@kernel(
    "float32[:,::1](int16[:,::1], float32[:,::1], float64, float64, float64, float64, float64, float64)",
)
def inflated_cost(
    evidence: Int16Array,
    seen: SingleArray,
    since: float,
    resolution: float,
    radius: float,
    reach: float,
    near_cost: float,
    unknown_cost: float,
) -> SingleArray:
    """Cost per cell for a robot of ``radius`` m: inf where it would touch, 1 + ``near_cost`` beside that, falling to 1
    at ``reach`` m from obstacles; ``unknown_cost`` more where nothing is known. Obstacles: evidence above 0, or
    ``seen`` not before ``since``.
    """
    height, width = evidence.shape
    marked = np.zeros((height, width), np.uint8)
    for row in range(height):
        for col in range(width):
            if evidence[row, col] > 0 or (seen[row, col] > 0 and seen[row, col] >= since):
                marked[row, col] = 1
    cost = distances(marked, reach / resolution)
    for row in range(height):
        for col in range(width):
            away = cost[row, col] * resolution
            if away < radius:
                cost[row, col] = np.inf
                continue
            share = (reach - away) / (reach - radius)
            value = 1.0 + near_cost * max(0.0, share) ** 2
            if evidence[row, col] == 0:
                value += unknown_cost
            cost[row, col] = value
    return cost


@kernel(
    "void(float32[:,::1], int16[:,::1], float32[:,::1], float64, uint8[:,::1], float64, float64)",
)
def reopen(
    cost: SingleArray,
    evidence: Int16Array,
    seen: SingleArray,
    since: float,
    trodden: ByteArray,
    reach: float,
    value: float,
) -> None:
    """Open the cells of ``cost`` that are ``trodden`` and have no obstacle within ``reach`` cells.

    They cost ``value``, and more by the square of the cells that something is closer than ``reach`` + 3. Obstacles as
    for ``inflated_cost``.
    """
    height, width = cost.shape
    around = int(np.ceil(reach)) + 3
    for row in range(height):
        some = np.uint8(0)
        for col in range(width):
            some |= trodden[row, col]
        for col in range(width if some else 0):  # most rows have none
            if trodden[row, col] == 0 or np.isfinite(cost[row, col]):
                continue
            nearest = (reach + 3.0) ** 2
            for r in range(max(0, row - around), min(height, row + around + 1)):
                for c in range(max(0, col - around), min(width, col + around + 1)):
                    if evidence[r, c] > 0 or (seen[r, c] > 0 and seen[r, c] >= since):
                        nearest = min(nearest, (r - row) ** 2 + (c - col) ** 2)
            if nearest >= reach * reach:
                cost[row, col] = value * (1.0 + (reach + 3.0 - np.sqrt(nearest)) ** 2)
