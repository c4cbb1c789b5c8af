"""The edge of the first step, from points on the ground ahead. Pure geometry in base_link, m; knows no robot.

Upwards, it is a riser: low, straight, without a wall right behind it. Downwards, it is the end of the floor: a line
between points of the floor and points where rays passed through its plane.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Pose
from roboglot.values import dataclass

STEP_MIN, STEP_MAX = 0.04, 0.25  # m: the height of one step, up or down
FLOOR = 0.025  # m: anything within this height is floor
REACH = 1.3  # m ahead that are examined
WIDE, CORRIDOR = math.radians(50.0), 0.3  # to both sides: rad for the first estimate, m beside the straight line to it
WIDTH_MIN = 0.25  # m of an edge that must be visible
FACE = 0.015  # m from its line within which a point lies on a riser
FACE_POINTS_MIN, FLOOR_POINTS_MIN, PASSES_MIN = 16, 8, 6
STRAY_MAX = 0.25  # share of the nearest points that may lie elsewhere
TREAD_MIN = 0.12  # m of tread that must lie before anything higher behind a riser
SLICE = math.radians(3.0)
TURNS = np.radians(np.arange(-42.0, 42.1, 1.0))
_COS, _SIN = np.cos(TURNS), np.sin(TURNS)
_CELL = 0.005
AWAY = np.arange(0.2, 1.2, _CELL)  # m to the lines that are tried
OUTLIERS = 2  # points tolerated in front of a riser
STRAYS_MAX = 0.04  # share of the points that may lie on the wrong side of the edge

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StepEdge:
    """``foot``: the nearest point of the edge's line, +x leading straight over it; ``left`` and ``right``: how far
    (m) from there the edge was seen.
    """

    foot: Pose
    left: float
    right: float

    @property
    def distance(self) -> float:
        """Distance from base_link to the line, m."""
        return math.hypot(self.foot.x, self.foot.y)


def find_riser(points: Points, walls: Points | None) -> StepEdge | None:
    """Return the riser in points (n x 3), or None; ``walls`` (n x 2): points above any step, None: not measured."""
    x, y, z = points.T
    bearing = np.arctan2(y, x)
    ahead = (x > 0.0) & (x < REACH) & (np.abs(bearing) < WIDE)
    low, high = points[ahead & (z > FLOOR) & (z < STEP_MAX)], points[ahead & (z >= STEP_MAX)]
    if len(low) < FACE_POINTS_MIN or (line := _line_through(_nearest_in_slices(low))) is None:
        return None
    for _ in range(3):
        u, v = _across(low, line)
        face = (np.abs(u) < FACE) & (np.abs(v) < CORRIDOR)
        if face.sum() < FACE_POINTS_MIN:
            return None
        line = _fit(low[face, :2])
    u, v = _across(low, line)
    face = (np.abs(u) < FACE) & (np.abs(v) < 2 * CORRIDOR)
    before = (u < -2 * FACE) & (np.abs(v) < CORRIDOR)
    if before.sum() > OUTLIERS or float(np.ptp(v[face])) < WIDTH_MIN or low[face, 2].max() < STEP_MIN:
        return None
    if _blocked(high[:, :2], line) or (walls is not None and _blocked(walls, line)):
        return None
    if walls is None and not _tread_seen(u, v, low[:, 2]):
        return None
    return StepEdge(line, float(v[face].max()), float(-v[face].min()))


def find_drop(floor: Points, beyond: Points) -> StepEdge | None:
    """Return the edge between points (n x 2) of the floor and those (m x 2) ``beyond`` it, or None."""
    line = _parting(floor, beyond)
    if line is None:  # the points may be a sheer side that forms a corner with the edge
        line = _parting(*(points[np.abs(points[:, 1]) < CORRIDOR] for points in (floor, beyond)))
    if line is None:
        return None
    u, v = _across(beyond, line)
    beside = v[u < -4 * FACE]  # a sheer side
    left, right = beside[beside > 0.0], -beside[beside < 0.0]
    return StepEdge(line, float(left.min(initial=2 * CORRIDOR)), float(right.min(initial=2 * CORRIDOR)))


def _nearest_in_slices(points: Points) -> Points:
    """Return the nearest point in each direction."""
    away = np.hypot(points[:, 0], points[:, 1])
    order = np.argsort(away)
    slices = np.floor(np.arctan2(points[order, 1], points[order, 0]) / SLICE)
    _, first = np.unique(slices, return_index=True)
    nearest: Points = points[order[first], :2]
    return nearest


def _line_through(points: Points) -> Pose | None:
    """Return the line through most of the points; None: there is none."""
    kept = points
    for _ in range(4):
        if len(kept) < 4:
            return None
        line = _fit(kept)
        u, _ = _across(points, line)
        near = np.abs(u) < max(3 * FACE if len(kept) == len(points) else 2 * FACE, float(np.median(np.abs(u))))
        kept = points[near]
    return line if len(kept) >= (1.0 - STRAY_MAX) * len(points) else None


def _fit(points: Points) -> Pose:
    """Return the line of least squares, as the foot of its perpendicular from the origin."""
    middle = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - middle, full_matrices=False)
    normal = axes[-1]
    distance = float(normal @ middle)
    if distance < 0.0:
        normal, distance = -normal, -distance
    return Pose(distance * float(normal[0]), distance * float(normal[1]), math.atan2(normal[1], normal[0]))


def _across(points: Points, line: Pose) -> tuple[Points, Points]:
    """Return each point's distance behind the line, and to the left of its foot, m."""
    c, s = math.cos(line.yaw), math.sin(line.yaw)
    x, y = points[:, 0] - line.x, points[:, 1] - line.y
    return c * x + s * y, c * y - s * x


def _blocked(taller: Points, line: Pose) -> bool:
    """True if an obstacle taller than a step leaves no tread behind the riser."""
    behind, aside = _across(taller, line)
    return bool(((np.abs(aside) < CORRIDOR) & (np.abs(behind) < TREAD_MIN)).any())


def _tread_seen(u: Points, v: Points, z: Points) -> bool:
    """True if there are points of a level tread right behind the riser."""
    tread = z[(u > 2 * FACE) & (u < TREAD_MIN) & (np.abs(v) < CORRIDOR)]
    return len(tread) >= FACE_POINTS_MIN and float(np.std(tread)) < FLOOR


def _parting(floor: Points, beyond: Points) -> Pose | None:
    """Return the line that separates both sets of points; None: there is none."""
    if len(floor) < FLOOR_POINTS_MIN or len(beyond) < PASSES_MIN:
        return None
    wrong = _wrong_sides(floor, beyond)
    if wrong.min() > STRAYS_MAX * (len(floor) + len(beyond)):
        return None
    # All lines that separate them are equally likely; their mean is the best estimate.
    likely = np.exp(wrong.min() - wrong.astype(np.float64))
    likely /= likely.sum()
    turn, distance = float(TURNS @ likely.sum(axis=1)), float(AWAY @ likely.sum(axis=0))
    line = Pose(distance * math.cos(turn), distance * math.sin(turn), turn)
    _, v = _across(floor, line)
    near = v[np.abs(v) < CORRIDOR]
    return line if len(near) and float(np.ptp(near)) >= WIDTH_MIN else None


def _wrong_sides(floor: Points, beyond: Points) -> NDArray[np.int64]:
    """Return the number of points on the wrong side of each line, by TURNS and AWAY."""
    floor_before = np.cumsum(_counts(floor), axis=1)
    beyond_before = np.cumsum(_counts(beyond), axis=1)
    return len(floor) - floor_before + beyond_before


def _counts(points: Points) -> NDArray[np.int64]:
    """Return the number of points by distance along each of TURNS, in steps of AWAY."""
    along = points @ np.stack((_COS, _SIN))
    cells = np.clip(np.ceil((along - AWAY[0]) / _CELL), 0, len(AWAY) - 1).astype(np.int64)
    cells += len(AWAY) * np.arange(len(TURNS))
    counts: NDArray[np.int64] = np.bincount(cells.ravel(), minlength=len(TURNS) * len(AWAY))
    return counts.reshape(len(TURNS), len(AWAY))
