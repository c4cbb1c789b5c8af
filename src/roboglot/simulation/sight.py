"""What can be seen in a horizontal plane of the world: still solids, people, obstacles, the other robots.

Truth, world frame; knows no sensor and no noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.simulation.blueprint import Kind, Solid, solids_of
from roboglot.simulation.description import Terrain, WorldDescription
from roboglot.simulation.hull import Hull
from roboglot.simulation.people import Walker
from roboglot.simulation.props import Props
from roboglot.simulation.sweep import NOTHING, Circles, Distances, Edges, directions, sweep
from roboglot.simulation.terrain import slices_of

KEPT_MAX = 64


class Sight:
    """Casts rays for the sensors. ``props`` and ``walkers`` are looked at anew each time."""

    def __init__(self, world: WorldDescription, hulls: Sequence[Hull], walkers: Sequence[Walker], props: Props) -> None:
        self._hulls, self._walkers, self._props = hulls, walkers, props
        self._floors = []
        for floor in world.floors:
            solids = solids_of(floor, world.lift, lift_here=True)
            self._floors.append(_Still([solid for solid in solids if solid.kind is not Kind.DOCK]))
        self._terrain = [floor.terrain for floor in world.floors]
        self._moving: dict[tuple[int, float], Circles] = {}  # what stands round and moves, by floor and height
        self._cast = sweep
        self._edges: dict[tuple[int, float], tuple[int, Edges]] = {}  # by floor and height, with the props' revision

    def load_kernel(self) -> None:
        """Cast by the compiled kernel from now on; takes a second, some more when nothing is compiled yet.

        Its distances agree with those of numpy to rounding, but not to the last bit.
        """
        from roboglot.kernels.sweep import sweep as compiled

        def cast(edges: Edges, circles: Circles, x: float, y: float, yaw: float, rays: int, reach: float) -> Distances:
            lines, rounds, ways = (_numbers(values) for values in (edges, circles, directions(rays)))
            distances: Distances = compiled(lines, rounds, ways, x, y, yaw, reach)
            return distances

        self._cast = cast

    def moved(self) -> None:
        """Forget where people and robots were."""
        self._moving.clear()

    def turn(self, hull: Hull, height: float, rays: int, reach: float) -> Distances:
        """Distances of a full turn around the middle of ``hull``, ``height`` m above its floor; see ``sweep``."""
        edges, circles = self._floors[hull.floor].at(height)
        edges = self._with_props(edges, hull.floor, height)
        if slopes := [solid for terrain in self._terrain[hull.floor] for solid in _slopes_at(terrain, height)]:
            edges = np.concatenate((edges, _edges_at(slopes, height)))
        key = hull.floor, round(height, 3)
        if key not in self._moving:
            moving = self._people_at(hull.floor, height) + self._robots_at(hull.floor, height)
            self._moving[key] = np.concatenate((circles, np.array(moving))) if moving else circles
        pose = hull.pose
        return self._cast(edges, self._moving[key], pose.x, pose.y, pose.yaw, rays, reach)

    def _with_props(self, edges: Edges, floor: int, height: float) -> Edges:
        """``edges`` and those of the movable boxes; kept until one of them moves."""
        revision, key = self._props.revisions[floor], (floor, round(height, 3))
        kept = self._edges.get(key)
        if kept is None or kept[0] != revision:
            if len(self._edges) > KEPT_MAX:
                self._edges.clear()
            props = _edges_at(self._props.on(floor), height)
            self._edges[key] = kept = revision, np.concatenate((edges, props)) if len(props) else edges
        return kept[1]

    def _people_at(self, floor: int, height: float) -> list[tuple[complex, complex]]:
        found = []
        for walker in self._walkers:
            person = walker.person
            if walker.floor == floor and 0.0 < height < person.height:
                # People are capsules: rounder towards feet and crown.
                off = max(0.0, person.radius - height, height - person.height + person.radius)
                radius = math.sqrt(person.radius**2 - off**2)
                found.append((complex(walker.pose.x, walker.pose.y), complex(radius)))
        return found

    def _robots_at(self, floor: int, height: float) -> list[tuple[complex, complex]]:
        """All of them: whoever looks is within its own circle, and nothing is seen from within."""
        return [
            (complex(hull.pose.x, hull.pose.y), complex(hull.body.hull.radius))
            for hull in self._hulls
            if hull.floor == floor and hull.covers(height)
        ]


def _numbers(values: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Complex numbers as their real and imaginary parts, a row for each row."""
    return values.view(np.float64).reshape(len(values), 2 if values.ndim == 1 else 2 * values.shape[1])


class _Still:
    """The still solids of a floor, sliced; slices are kept, since heights change little."""

    def __init__(self, solids: list[Solid]) -> None:
        self._solids = solids
        heights = {solid.base for solid in solids} | {solid.base + solid.size[2] for solid in solids}
        self._steps = np.array(sorted(heights))
        self._slices: dict[int, tuple[Edges, Circles]] = {}

    def at(self, height: float) -> tuple[Edges, Circles]:
        """Edges and circles at ``height`` above the floor."""
        band = int(np.searchsorted(self._steps, height, side="right"))
        if band not in self._slices:
            self._slices[band] = _edges_at(self._solids, height), _circles_at(self._solids, height)
        return self._slices[band]


def _slopes_at(terrain: Terrain, height: float) -> Iterator[Solid]:
    """What of a ramp is higher than ``height``, as boxes."""
    for middle, length, width in slices_of(terrain, height):
        yield Solid(Kind.FURNITURE, middle, (length, width, math.inf))


def _edges_at(solids: Sequence[Solid], height: float) -> Edges:
    """The edges of the boxes at ``height``, counter-clockwise around each."""
    edges = []
    for solid in solids:
        if solid.round or not solid.base <= height < solid.base + solid.size[2]:
            continue
        middle = complex(solid.pose.x, solid.pose.y)
        along = complex(math.cos(solid.pose.yaw), math.sin(solid.pose.yaw))
        x, y = along * solid.size[0] / 2, 1j * along * solid.size[1] / 2
        corners = (middle - x - y, middle + x - y, middle + x + y, middle - x + y)
        edges += [(corners[i], corners[(i + 1) % 4]) for i in range(4)]
    return np.array(edges) if edges else NOTHING


def _circles_at(solids: Sequence[Solid], height: float) -> Circles:
    """The cylinders at ``height``."""
    circles = [
        (complex(solid.pose.x, solid.pose.y), complex(solid.size[0] / 2))
        for solid in solids
        if solid.round and solid.base <= height < solid.base + solid.size[2]
    ]
    return np.array(circles) if circles else NOTHING
