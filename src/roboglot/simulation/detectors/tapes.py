"""Lines on a floor as evenly spaced points with direction and curvature. Plain geometry, world frame."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.model.perception import Colour
from roboglot.simulation.world.description import Floor, Line
from roboglot.values import dataclass

Floats = NDArray[np.float64]
SPACING = 0.02  # m between points
SMOOTH = 6  # points on either side over which curvature is computed
POINTS_MAX = 20_000  # per line


@dataclass(frozen=True, slots=True, eq=False)
class Tape:
    """``points`` (n x 2, m); ``curvature`` (n): 1/m, positive to the left along the tape. ``closed``: a ring."""

    colour: Colour
    points: Floats
    curvature: Floats
    closed: bool


def tapes_of(floor: Floor) -> list[Tape]:
    """Return all lines of a floor (world)."""
    return [_tape(line) for line in floor.lines]


def _tape(line: Line) -> Tape:
    corners = np.array(line.points)
    closed = len(corners) > 2 and math.dist(corners[0], corners[-1]) < SPACING
    ways = np.concatenate(((0.0,), np.cumsum(np.hypot(*np.diff(corners, axis=0).T))))
    count = min(POINTS_MAX, max(2, round(ways[-1] / SPACING) + 1))
    along = np.linspace(0.0, ways[-1], count)
    points = np.stack([np.interp(along, ways, corners[:, axis]) for axis in (0, 1)], axis=1)
    if closed:
        points = points[:-1]
    return Tape(Colour(line.colour), points, _curvature(points, closed), closed)


def _curvature(points: Floats, closed: bool) -> Floats:
    """Return the curvature (1/m) at each point, over SMOOTH points before and after."""
    padded = np.pad(points, ((SMOOTH, SMOOTH), (0, 0)), mode="wrap" if closed else "edge")
    before, after = points - padded[: -2 * SMOOTH], padded[2 * SMOOTH :] - points
    lengths = np.hypot(*before.T), np.hypot(*after.T)
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    dot = (before * after).sum(axis=1)
    way = (lengths[0] + lengths[1]) / 2
    curvature: Floats = np.where(np.minimum(*lengths) > SPACING, np.arctan2(cross, dot) / np.maximum(way, 1e-9), 0.0)
    return curvature
