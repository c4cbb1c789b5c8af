"""Searches for the pose where a scan fits best in a map's field of likelihood.

In a window of poses: a correlative search (Olson 2009, one resolution). In a whole map: branch and bound, exact on its
steps.

A bound for a square of places is the sum, over the scan's points, of the best field value within the square's size
(``pyramid``). Squares that cannot beat the best place found are dropped unseen.
"""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray, FloatArray, Int16Array, Int32Array, IntArray
from roboglot.kernels.compiled import kernel

STACK_MAX = 64  # at most three squares wait on each level


def pyramid(field: ByteArray, levels: int) -> ByteArray:
    """Level k holds at [row + pad, col + pad] the highest of field[row : row + 2**k, col : col + 2**k].

    ``pad`` is 2**(levels - 1): squares may begin before the field does.
    """
    pad = 1 << (levels - 1)
    result = np.zeros((levels, field.shape[0] + pad, field.shape[1] + pad), np.uint8)
    result[0, pad:, pad:] = field
    for level in range(1, levels):
        step, finer, coarser = 1 << (level - 1), result[level - 1], result[level]
        wide = finer.copy()
        np.maximum(finer[:, :-step], finer[:, step:], out=wide[:, :-step])
        np.maximum(wide[:-step], wide[step:], out=coarser[:-step])
        np.maximum(wide[-step:], wide[-1], out=coarser[-step:])
    return result


@kernel("int64(uint8[:,:,::1], int64, int32[:,::1], int64, int64, int64)")
def _bound(fields: ByteArray, level: int, offsets: Int32Array, row: int, col: int, enough: int) -> int:
    """Upper bound of the score of all places in the square at (row, col); 0 as soon as it cannot exceed ``enough``."""
    pad = 1 << (fields.shape[0] - 1)
    height, width = fields.shape[1], fields.shape[2]
    count, total = offsets.shape[0], np.int64(0)
    for i in range(count):
        r, c = row + offsets[i, 0] + pad, col + offsets[i, 1] + pad
        if 0 <= r < height and 0 <= c < width:
            total += fields[level, r, c]
        if i & 15 == 15 and total + 255 * (count - 1 - i) <= enough:
            return 0
    return int(total) if total > enough else 0


@kernel("int32[:,:,::1](float64[:,::1], int64, float64)")
def turned_offsets(points: FloatArray, headings: int, resolution: float) -> Int32Array:
    """Return by heading the (row, column) of each point (n, 2; m) relative to the cell with base_link at its centre."""
    result = np.empty((headings, points.shape[0], 2), np.int32)
    for heading in range(headings):
        yaw = 2.0 * np.pi * heading / headings
        cos, sin = np.cos(yaw), np.sin(yaw)
        for i in range(points.shape[0]):
            result[heading, i, 0] = int(np.floor((sin * points[i, 0] + cos * points[i, 1]) / resolution + 0.5))
            result[heading, i, 1] = int(np.floor((cos * points[i, 0] - sin * points[i, 1]) / resolution + 0.5))
    return result


@kernel("int64[:,::1](uint8[:,:,::1], uint8[:,:,::1], int32[:,:,::1], int64)")
def _roots(fields: ByteArray, floors: ByteArray, offsets: Int32Array, enough: int) -> IntArray:
    """Return the largest squares with floor in them, for every heading: (bound, heading, row, col)."""
    top = fields.shape[0] - 1
    size = 1 << top
    height, width = fields.shape[1] - size, fields.shape[2] - size
    found = np.empty((offsets.shape[0] * (height // size + 1) * (width // size + 1), 4), np.int64)
    count = 0
    for heading in range(offsets.shape[0]):
        for row in range(0, height, size):
            for col in range(0, width, size):
                if floors[top, row + size, col + size] == 0:
                    continue
                bound = _bound(fields, top, offsets[heading], row, col, enough)
                if bound > 0:
                    found[count, 0], found[count, 1], found[count, 2], found[count, 3] = bound, heading, row, col
                    count += 1
    return found[:count]


@kernel("boolean(int64[:,::1], int64, int64, int64, int64, int64, int64)")
def _is_taken(taken: IntArray, heading: int, row: int, col: int, apart: int, turned: int, headings: int) -> bool:
    """Return whether (heading, row, col) lies within ``apart`` cells and ``turned`` headings of an earlier find."""
    for k in range(taken.shape[0]):
        turn = abs(heading - taken[k, 0])
        if min(turn, headings - turn) > turned:
            continue
        if abs(row - taken[k, 1]) <= apart and abs(col - taken[k, 2]) <= apart:
            return True
    return False


@kernel(
    "UniTuple(int64, 4)(uint8[:,:,::1], uint8[:,:,::1], int32[:,:,::1], int64, int64[:,::1], int64, int64,"
    " int64[:,::1])",
)
def _best_below(
    fields: ByteArray,
    floors: ByteArray,
    offsets: Int32Array,
    enough: int,
    taken: IntArray,
    apart: int,
    turned: int,
    roots: IntArray,
) -> tuple[int, int, int, int]:
    """Return the best (score, heading, row, col) above ``enough``, away from ``taken``, in the squares ``roots``."""
    top = fields.shape[0] - 1
    pad = 1 << top
    height, width = fields.shape[1] - pad, fields.shape[2] - pad
    best = (0, 0, 0, 0)
    stack, children = np.empty((STACK_MAX, 4), np.int64), np.empty((4, 3), np.int64)
    for root in range(roots.shape[0]):
        bound, heading = roots[root, 0], roots[root, 1]
        if bound <= enough:
            break
        size = 1
        stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = bound, top, roots[root, 2], roots[root, 3]
        while size > 0:
            size -= 1
            bound, level, row, col = stack[size, 0], stack[size, 1], stack[size, 2], stack[size, 3]
            if bound <= enough:
                continue
            if level == 0:
                if _is_taken(taken, heading, stack[size, 2], stack[size, 3], apart, turned, offsets.shape[0]):
                    continue
                enough, best = bound, (bound, heading, row, col)
                continue
            half, count = 1 << (level - 1), 0
            for k in range(4):
                r, c = row + (k // 2) * half, col + (k % 2) * half
                if r >= height or c >= width or floors[level - 1, r + pad, c + pad] == 0:
                    continue
                score = _bound(fields, level - 1, offsets[heading], r, c, enough)
                if score == 0:
                    continue
                at = count  # in ascending order: the best is examined first
                while at > 0 and children[at - 1, 0] > score:
                    for part in range(3):
                        children[at, part] = children[at - 1, part]
                    at -= 1
                children[at, 0], children[at, 1], children[at, 2] = score, r, c
                count += 1
            for k in range(count):
                stack[size, 0], stack[size, 1] = children[k, 0], level - 1
                stack[size, 2], stack[size, 3] = children[k, 1], children[k, 2]
                size += 1
    return best


class PlaceSearch:
    """Search for one place after another on the floor, best first, each away from all earlier ones.

    ``fields``, ``floors``: pyramids of the likelihood field and of where base_link may be; ``offsets``: see above;
    ``apart``: cells and headings within which two places are one.
    """

    def __init__(self, fields: ByteArray, floors: ByteArray, offsets: Int32Array, apart: tuple[int, int]) -> None:
        self._fields, self._floors, self._offsets, self._apart = fields, floors, offsets, apart
        self._taken: IntArray = np.empty((0, 3), np.int64)
        self._roots: IntArray | None = None

    def next(self, enough: int) -> tuple[int, int, int, int]:
        """Return (score, heading, row, col) of the next place that scores above ``enough``, which must never decrease.

        Score 0 if none does.
        """
        if self._roots is None:
            roots = _roots(self._fields, self._floors, self._offsets, enough)
            self._roots = np.ascontiguousarray(roots[np.argsort(-roots[:, 0], kind="stable")])
        found = _best_below(self._fields, self._floors, self._offsets, enough, self._taken, *self._apart, self._roots)
        self._taken = np.concatenate((self._taken, np.array([found[1:]], np.int64)))
        return found


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
