"""Lines of sight between places in three dimensions. Truth, world frame, per floor.

A person counts as the block around the present posture, a robot as a cylinder. Ramps and floors hide nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Point, Pose
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.building.blueprint import Solid, SolidKind, solids_of
from roboglot.simulation.building.props import Props
from roboglot.simulation.people import figure
from roboglot.simulation.people.people import Walker
from roboglot.simulation.world.description import WorldDescription
from roboglot.values import dataclass

Floats = NDArray[np.float64]
FEET_TO_HEAD = (0.15, 0.6, 1.2)  # m above the floor
SHORT = 0.02  # m before its end where a line of sight stops: the target lies on a surface
Row = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Obstacles:
    """Obstacles on a floor at one moment.

    Rows: middle x, y, z from the floor, half extents x, y, z, yaw, 1 for a cylinder. ``movers``: rows of moving ones.
    """

    rows: Floats
    movers: Mapping[Hull | Walker, int]
    elevation: float

    def clear(self, eye: Floats, places: Floats, but: Iterable[Hull | Walker]) -> NDArray[np.bool_]:
        """Return for each place (n, 3; world) whether nothing except ``but`` hides it from ``eye``."""
        rows = np.delete(self.rows, [self.movers[one] for one in but if one in self.movers], axis=0)
        ways = places - eye
        lengths = np.linalg.norm(ways, axis=1)
        ways = ways * np.maximum(0.0, 1.0 - SHORT / np.maximum(lengths, SHORT))[:, None]
        start = eye - (0.0, 0.0, self.elevation)
        round_ = rows[:, 7] == 1.0
        return ~(_meet_boxes(rows[~round_], start, ways) | _meet_cylinders(rows[round_], start, ways))


class SightLines:
    """Lines of sight of one world, always past the present ``walkers``, ``hulls`` and ``props``."""

    def __init__(self, world: WorldDescription, hulls: Sequence[Hull], walkers: Sequence[Walker], props: Props) -> None:
        self._world, self._hulls, self._walkers, self._props = world, hulls, walkers, props
        self._still: dict[int, list[Row]] = {}

    def now(self, floor: int) -> Obstacles:
        """Return all obstacles on a floor, at their present places."""
        if floor not in self._still:
            solids = solids_of(self._world.floors[floor], self._world.lift, lift_here=True)
            # Docks are props.
            self._still[floor] = [_row(solid) for solid in solids if solid.kind is not SolidKind.DOCK]
        rows = [*self._still[floor], *(_row(solid) for solid in self._props.on(floor))]
        movers: dict[Hull | Walker, int] = {}
        for walker in self._walkers:
            if walker.floor == floor:
                movers[walker] = len(rows)
                rows.append(_person_row(walker))
        for hull in self._hulls:
            if hull.floor == floor:
                movers[hull] = len(rows)
                rows.append(_robot_row(hull))
        return Obstacles(np.array(rows).reshape(-1, 8), movers, self._world.elevation(floor))

    def leads(self, walker: Walker, spot: Point) -> bool:
        """True if the person can walk straight to that place: the way and the place are free."""
        obstacles, (x, y) = self.now(walker.floor), (walker.pose.x, walker.pose.y)
        away = max(1e-6, math.hypot(spot.x - x, spot.y - y))
        beyond = 1.0 + walker.person.radius / away
        ends = np.array([(x + beyond * (spot.x - x), y + beyond * (spot.y - y))])
        return all(
            bool(
                obstacles.clear(
                    np.array((x, y, obstacles.elevation + height)),
                    np.append(ends, [[obstacles.elevation + height]], axis=1),
                    (walker,),
                ).all()
            )
            for height in FEET_TO_HEAD
        )


def _row(solid: Solid) -> Row:
    width, depth, height = solid.size
    x, y, yaw = solid.pose.x, solid.pose.y, solid.pose.yaw
    return x, y, solid.base + height / 2, width / 2, depth / 2, height / 2, yaw, float(solid.round)


def _robot_row(hull: Hull) -> Row:
    section = hull.body.hull
    low, high = hull.rise + section.clearance, hull.rise + hull.belly + section.torso_height
    radius = section.radius
    return hull.pose.x, hull.pose.y, (low + high) / 2, radius, radius, (high - low) / 2, 0.0, 1.0


def _person_row(walker: Walker) -> Row:
    low, high = figure.extent(walker.joints)
    middle, half = (low + high) / 2, (high - low) / 2
    at = walker.pose.compose(Pose(float(middle[0]), float(middle[1])))
    return at.x, at.y, float(middle[2]), *(0.85 * half[:2]).tolist(), float(half[2]), walker.pose.yaw, 0.0


def _meet_boxes(blocks: Floats, eye: Floats, ways: Floats) -> NDArray[np.bool_]:
    """Return for each way whether it passes through a box (slab test in the boxes' own frames)."""
    if not len(blocks):
        return np.zeros(len(ways), dtype=bool)
    c, s = np.cos(blocks[:, 6]), np.sin(blocks[:, 6])
    off = eye - blocks[:, :3]
    start = np.stack((c * off[:, 0] + s * off[:, 1], c * off[:, 1] - s * off[:, 0], off[:, 2]), axis=1)  # m x 3
    x, y, z = (ways[:, axis, None] for axis in range(3))
    along = np.stack((c * x + s * y, c * y - s * x, np.broadcast_to(z, (len(ways), len(blocks)))), axis=2)
    along = np.where(np.abs(along) < 1e-12, 1e-12, along)
    one, other = (-blocks[:, 3:6] - start) / along, (blocks[:, 3:6] - start) / along
    enter, leave = np.minimum(one, other).max(axis=2), np.maximum(one, other).min(axis=2)
    met: NDArray[np.bool_] = np.any((enter < leave) & (leave > 0.0) & (enter < 1.0), axis=1)
    return met


def _meet_cylinders(blocks: Floats, eye: Floats, ways: Floats) -> NDArray[np.bool_]:
    """Return for each way whether it passes through a standing cylinder."""
    if not len(blocks):
        return np.zeros(len(ways), dtype=bool)
    off = eye - blocks[:, :3]
    x, y, z = (ways[:, axis, None] for axis in range(3))
    a = np.maximum(x * x + y * y, 1e-18)
    b = x * off[:, 0] + y * off[:, 1]
    inner = b * b - a * (off[:, 0] ** 2 + off[:, 1] ** 2 - blocks[:, 3] ** 2)
    root = np.sqrt(np.maximum(inner, 0.0))
    z = np.where(np.abs(z) < 1e-12, 1e-12, z)
    low, high = (-blocks[:, 5] - off[:, 2]) / z, (blocks[:, 5] - off[:, 2]) / z
    enter = np.maximum((-b - root) / a, np.minimum(low, high))
    leave = np.minimum((-b + root) / a, np.maximum(low, high))
    met: NDArray[np.bool_] = np.any((inner > 0.0) & (enter < leave) & (leave > 0.0) & (enter < 1.0), axis=1)
    return met
