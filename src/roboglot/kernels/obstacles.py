"""What the lidar sees now against where the robot wants to go: obstacle memory, inflation, free way along a path."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray, FloatArray, Int16Array, IntArray, SingleArray
from roboglot.kernels.compiled import kernel
from roboglot.kernels.distance import distances


@kernel("boolean(int16[:,::1], int64, int64)")
def _beside_occupied(evidence: Int16Array, row: int, col: int) -> bool:
    """Whether the cell or one of its eight neighbours is occupied."""
    for r in range(max(0, row - 1), min(evidence.shape[0], row + 2)):
        for c in range(max(0, col - 1), min(evidence.shape[1], col + 2)):
            if evidence[r, c] > 0:
                return True
    return False


@kernel(
    "void(int16[:,::1], float32[:,::1], float64[:,::1], uint8[::1], float64, float64, float64, float64)",
)
def remember(
    evidence: Int16Array,
    seen: SingleArray,
    ends: FloatArray,
    hit: ByteArray,
    x: float,
    y: float,
    now: float,
    resolution: float,
) -> None:
    """Note the time ``now`` (> 0) in cells with a hit that the map does not explain; 0 in those that rays pass.

    ``ends`` (n, 2) and (x, y) are metres from the grid's corner.
    """
    height, width = seen.shape
    for i in range(ends.shape[0]):
        dx, dy = ends[i, 0] - x, ends[i, 1] - y
        count = int(np.sqrt(dx * dx + dy * dy) / resolution)  # the last cell before the end is left alone
        step_x, step_y = dx / (count + 1.0) / resolution, dy / (count + 1.0) / resolution  # in cells
        for k in range(count):
            col = int(np.floor(x / resolution + k * step_x))
            row = int(np.floor(y / resolution + k * step_y))
            if 0 <= row < height and 0 <= col < width:
                seen[row, col] = 0.0
    for i in range(ends.shape[0]):
        col, row = int(np.floor(ends[i, 0] / resolution)), int(np.floor(ends[i, 1] / resolution))
        if hit[i] and 0 <= row < height and 0 <= col < width and not _beside_occupied(evidence, row, col):
            seen[row, col] = now


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


@kernel("float64(float64[:,::1], float64[:,::1], float64, float64, float64)")
def free_way(path: FloatArray, points: FloatArray, x: float, y: float, radius: float) -> float:
    """How far a disc of ``radius`` can go along ``path`` (n, 2; m, dense) before it touches one of ``points``.

    inf: all the way.
    Points that it only gets farther from are no hindrance: who stands close to a wall may leave it.
    """
    gone = 0.0
    for i in range(path.shape[0]):
        if i > 0:
            gone += np.sqrt((path[i, 0] - path[i - 1, 0]) ** 2 + (path[i, 1] - path[i - 1, 1]) ** 2)
        for k in range(points.shape[0]):
            away = (path[i, 0] - points[k, 0]) ** 2 + (path[i, 1] - points[k, 1]) ** 2
            if away < radius * radius:
                now = np.sqrt((x - points[k, 0]) ** 2 + (y - points[k, 1]) ** 2)
                if np.sqrt(away) < now - 0.01:
                    return gone
    return np.inf


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


@kernel("int16[:,::1](int16[:,::1], int64)")
def without_things(evidence: Int16Array, size: int) -> Int16Array:
    """A copy in which everything is free that is occupied, at most ``size`` cells long and wide, and touches nothing.

    What touches: cells with at most one free cell between them belong together, as an echo's neighbours do.
    """
    height, width = evidence.shape
    kept = evidence.copy()
    visited = np.zeros((height, width), np.uint8)
    cells = np.empty((height * width, 2), np.int32)
    for row in range(height):
        for col in range(width):
            if evidence[row, col] <= 0 or visited[row, col]:
                continue
            count, at = 1, 0
            cells[0, 0], cells[0, 1] = row, col
            visited[row, col] = 1
            top, bottom, left, right = row, row, col, col
            while at < count:
                r0, c0 = cells[at, 0], cells[at, 1]
                at += 1
                top, bottom, left, right = min(top, r0), max(bottom, r0), min(left, c0), max(right, c0)
                for r in range(max(0, r0 - 2), min(height, r0 + 3)):
                    for c in range(max(0, c0 - 2), min(width, c0 + 3)):
                        if evidence[r, c] > 0 and not visited[r, c]:
                            visited[r, c] = 1
                            cells[count, 0], cells[count, 1] = r, c
                            count += 1
            if bottom - top < size and right - left < size:
                for k in range(count):
                    kept[cells[k, 0], cells[k, 1]] = -1
    return kept


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
        for col in range(width):
            if trodden[row, col] == 0 or np.isfinite(cost[row, col]):
                continue
            nearest = (reach + 3.0) ** 2
            for r in range(max(0, row - around), min(height, row + around + 1)):
                for c in range(max(0, col - around), min(width, col + around + 1)):
                    if evidence[r, c] > 0 or (seen[r, c] > 0 and seen[r, c] >= since):
                        nearest = min(nearest, (r - row) ** 2 + (c - col) ** 2)
            if nearest >= reach * reach:
                cost[row, col] = value * (1.0 + (reach + 3.0 - np.sqrt(nearest)) ** 2)
