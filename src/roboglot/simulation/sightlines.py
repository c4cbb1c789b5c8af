"""Lines of sight in three dimensions: what stands between a place and another. Truth, world frame, per floor.

People count as the block that holds their body as they hold it, robots as cylinders. Ramps and floors hide nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Pose
from roboglot.simulation import figure
from roboglot.simulation.blueprint import Kind, Solid, solids_of
from roboglot.simulation.description import WorldDescription
from roboglot.simulation.hull import Hull
from roboglot.simulation.people import Walker
from roboglot.simulation.props import Props

Floats = NDArray[np.float64]
SHORT = 0.02  # m before its end that a line of sight stops: what is looked at lies on something
NO_BLOCKS = np.empty((0, 8))


class SightLines:
    """``walkers``, ``hulls`` and ``props`` are looked at anew each time."""

    def __init__(self, world: WorldDescription, hulls: Sequence[Hull], walkers: Sequence[Walker], props: Props) -> None:
        self._world, self._hulls, self._walkers, self._props = world, hulls, walkers, props
        self._still: dict[int, Floats] = {}

    def clear(self, floor: int, eye: Floats, places: Floats, but: Iterable[Hull | Walker]) -> NDArray[np.bool_]:
        """For each of the places (n x 3, z in world), whether nothing but ``but`` stands before it."""
        ground = np.array((0.0, 0.0, self._world.elevation(floor)))
        blocks = self._blocks(floor, tuple(but))
        eye, ways = eye - ground, places - eye
        lengths = np.linalg.norm(ways, axis=1)
        ways = ways * np.maximum(0.0, 1.0 - SHORT / np.maximum(lengths, SHORT))[:, None]
        boxed, round_ = blocks[blocks[:, 7] == 0.0], blocks[blocks[:, 7] == 1.0]
        return ~(_meet_boxes(boxed, eye, ways) | _meet_cylinders(round_, eye, ways))

    def _blocks(self, floor: int, but: tuple[Hull | Walker, ...]) -> Floats:
        """Rows: middle x, y, z, half extents x, y, z, yaw, and 1 for a cylinder."""
        if floor not in self._still:
            solids = solids_of(self._world.floors[floor], self._world.lift, lift_here=True)
            rows = [_row(solid) for solid in solids if solid.kind is not Kind.DOCK]  # docks are props
            self._still[floor] = np.array(rows) if rows else NO_BLOCKS
        moving = [_row(solid) for solid in self._props.on(floor)]
        for walker in self._walkers:
            if walker.floor == floor and walker not in but:
                moving.append(_person_row(walker))
        for hull in self._hulls:
            if hull.floor == floor and hull not in but:
                section = hull.body.hull
                low, high = hull.rise + section.clearance, hull.rise + hull.belly + section.torso_height
                radius = section.radius
                middle = (hull.pose.x, hull.pose.y, (low + high) / 2)
                moving.append((*middle, radius, radius, (high - low) / 2, 0.0, 1.0))
        return np.concatenate((self._still[floor], np.array(moving))) if moving else self._still[floor]


def _row(solid: Solid) -> tuple[float, ...]:
    width, depth, height = solid.size
    x, y, yaw = solid.pose.x, solid.pose.y, solid.pose.yaw
    return x, y, solid.base + height / 2, width / 2, depth / 2, height / 2, yaw, float(solid.round)


def _person_row(walker: Walker) -> tuple[float, ...]:
    low, high = figure.extent(walker.joints)
    middle, half = (low + high) / 2, (high - low) / 2
    at = walker.pose.compose(Pose(float(middle[0]), float(middle[1])))
    return at.x, at.y, float(middle[2]), *(0.85 * half[:2]).tolist(), float(half[2]), walker.pose.yaw, 0.0


def _meet_boxes(blocks: Floats, eye: Floats, ways: Floats) -> NDArray[np.bool_]:
    """For each way, whether it leads through a box (slab test in the boxes' own frames)."""
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
    """For each way, whether it leads through a standing cylinder."""
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
