"""Alignment and merging of two maps."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.model.errors import Refused
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = lazy("numpy")

CELLS_MAX = 25_000_000
POINTS_MAX = 1500  # of the other map's walls, used to find the fit
STEPS = ((1.0, 0.1, 0.15, 0.05), (0.1, 0.05, 0.05, 0.01), (0.05, 0.025, 0.01, 0.0025))  # m around, by; rad around, by
SURE = 127


def aligned(base: OccupancyGrid, other: OccupancyGrid, guess: Pose) -> Pose:
    """Return the pose of ``other``'s map frame in ``base``'s that aligns their walls, near ``guess``.

    Without common walls, return the guess.
    """
    walls = _walls(other)
    near = _blurred(base.log_odds > 0)
    best, score = guess, _score(near, base, walls, guess)
    for reach, step, turn, angle in STEPS:
        middle = best
        spread = np.arange(-reach, reach + step / 2, step)
        turns = np.arange(-turn, turn + angle / 2, angle)
        for dx, dy, yaw in itertools.product(spread, spread, turns):
            pose = Pose(middle.x + float(dx), middle.y + float(dy), middle.yaw + float(yaw))
            found = _score(near, base, walls, pose)
            if found > score + 1e-9:
                best, score = pose, found
    return best


def merged(base: OccupancyGrid, other: OccupancyGrid, place: Pose) -> OccupancyGrid:
    """Return both maps as one in ``base``'s frame; evidence adds up where both have some.

    ``place`` is the origin of ``other``'s frame. Raises Refused if the result would be too large.
    """
    corners = [_moved(np.array([[x, y]]), place)[0] for x, y in itertools.product(*_extent(other))]
    (left, right), (bottom, top) = _extent(base)
    size = base.resolution
    before = max(0, math.ceil((left - min(c[0] for c in corners)) / size))
    below = max(0, math.ceil((bottom - min(c[1] for c in corners)) / size))
    after = max(0, math.ceil((max(c[0] for c in corners) - right) / size))
    above = max(0, math.ceil((max(c[1] for c in corners) - top) / size))
    if (base.width + before + after) * (base.height + below + above) > CELLS_MAX:
        raise Refused("the two maps lie too far apart")
    sum_of_both = np.pad(base.log_odds.astype(np.int16), ((below, above), (before, after)))
    origin = Point(left - before * size, bottom - below * size)
    _add(sum_of_both, OccupancyGrid(base.log_odds[:0, :0], size, origin), other, place)
    return OccupancyGrid(np.clip(sum_of_both, -SURE, SURE).astype(np.int8), size, origin)


def _add(cells: NDArray[np.int16], frame: OccupancyGrid, other: OccupancyGrid, place: Pose) -> None:
    """Add ``other``'s evidence at the centre of each cell; row by row, to save memory."""
    c, s = math.cos(place.yaw), math.sin(place.yaw)
    x = frame.origin.x + (np.arange(cells.shape[1]) + 0.5) * frame.resolution - place.x
    for row, line in enumerate(cells):
        y = frame.origin.y + (row + 0.5) * frame.resolution - place.y
        col = np.floor((c * x + s * y - other.origin.x) / other.resolution).astype(np.int64)
        their = np.floor((c * y - s * x - other.origin.y) / other.resolution).astype(np.int64)
        inside = (col >= 0) & (col < other.width) & (their >= 0) & (their < other.height)
        line[inside] += other.log_odds[their[inside], col[inside]]


def _walls(grid: OccupancyGrid) -> NDArray[np.float64]:
    """Return the middles of occupied cells (map frame, m), evenly thinned."""
    rows, cols = np.nonzero(grid.log_odds > 0)
    chosen = slice(None, None, max(1, len(rows) // POINTS_MAX))
    return np.stack(
        [
            grid.origin.x + (cols[chosen] + 0.5) * grid.resolution,
            grid.origin.y + (rows[chosen] + 0.5) * grid.resolution,
        ],
        axis=1,
    )


def _moved(points: NDArray[np.float64], pose: Pose) -> NDArray[np.float64]:
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    return np.stack(
        [pose.x + c * points[:, 0] - s * points[:, 1], pose.y + s * points[:, 0] + c * points[:, 1]], axis=1
    )


def _blurred(walls: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return 1 at walls, less beside them."""
    near = walls.astype(np.float32)
    for axis, shift in itertools.product((0, 1), (1, -1)):
        near = np.maximum(near, 0.6 * np.roll(near, shift, axis))
    return near


def _score(near: NDArray[np.float32], base: OccupancyGrid, walls: NDArray[np.float64], pose: Pose) -> float:
    cells = np.floor((_moved(walls, pose) - (base.origin.x, base.origin.y)) / base.resolution).astype(np.int64)
    inside = (cells >= 0).all(axis=1) & (cells[:, 0] < base.width) & (cells[:, 1] < base.height)
    return float(near[cells[inside, 1], cells[inside, 0]].sum())


def _extent(grid: OccupancyGrid) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the borders along x and along y."""
    x, y = grid.origin.x, grid.origin.y
    return (x, x + grid.width * grid.resolution), (y, y + grid.height * grid.resolution)
