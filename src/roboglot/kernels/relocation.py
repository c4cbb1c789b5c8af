"""Finding a pose again: a correlative search over a window of poses (Olson 2009, one resolution)."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray, FloatArray, Int16Array
from roboglot.kernels.compiled import kernel


@kernel("uint8[:,::1](int16[:,::1])")
def likelihood_field(evidence: Int16Array) -> ByteArray:
    """255 in occupied cells, less in the two rings around them, 0 elsewhere."""
    height, width = evidence.shape
    field = np.zeros((height, width), np.uint8)
    for row in range(height):
        for col in range(width):
            if evidence[row, col] <= 0:
                continue
            for r in range(max(0, row - 2), min(height, row + 3)):
                for c in range(max(0, col - 2), min(width, col + 3)):
                    ring = max(abs(r - row), abs(c - col))
                    value = 255 if ring == 0 else (150 if ring == 1 else 60)
                    field[r, c] = max(field[r, c], value)
    return field


@kernel(
    "UniTuple(float64, 4)(uint8[:,::1], float64[:,::1], float64[::1], float64, float64, float64, float64, float64)",
)
def correlate(
    field: ByteArray,
    points: FloatArray,
    centre: FloatArray,
    resolution: float,
    reach: float,
    turn: float,
    turn_step: float,
    edge_cost: float,
) -> tuple[float, float, float, float]:
    """Return the best pose within ``reach`` m (in cells) and ``turn`` rad around ``centre``: x, y, yaw, score 0..1.

    ``points`` (n, 2) are in base_link, ``centre`` is (x, y from the grid's corner, yaw). A pose at the window's edge
    scores ``edge_cost`` (0..1) less than one in its middle, others by the square of their distance. Ties go to the
    smaller yaw, then y, then x.
    """
    height, width = field.shape
    steps, turns = int(np.ceil(reach / resolution)), int(np.ceil(turn / turn_step))
    count = points.shape[0]
    rows, cols = np.empty(count, np.int64), np.empty(count, np.int64)
    best, best_x, best_y, best_yaw = -np.inf, centre[0], centre[1], centre[2]
    cost = edge_cost * 255.0 * count
    per_step, per_turn = cost / max(1, steps * steps), cost / max(1, turns * turns)
    for t in range(-turns, turns + 1):
        yaw = centre[2] + t * turn_step
        cos, sin = np.cos(yaw), np.sin(yaw)
        for i in range(count):
            cols[i] = int(np.floor((centre[0] + cos * points[i, 0] - sin * points[i, 1]) / resolution))
            rows[i] = int(np.floor((centre[1] + sin * points[i, 0] + cos * points[i, 1]) / resolution))
        for down in range(-steps, steps + 1):
            for along in range(-steps, steps + 1):
                hits = np.int64(0)
                for i in range(count):
                    row, col = rows[i] + down, cols[i] + along
                    if 0 <= row < height and 0 <= col < width:
                        hits += field[row, col]
                score = hits - per_step * (down * down + along * along) - per_turn * t * t
                if score > best:
                    best = score
                    best_x, best_y = centre[0] + along * resolution, centre[1] + down * resolution
                    best_yaw = yaw
    return best_x, best_y, best_yaw, best / (255.0 * max(1, count))
