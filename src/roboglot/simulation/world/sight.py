"""Sight in a horizontal plane of the world: still solids, people, obstacles, things, the other robots.

Truth, world frame; knows no sensor. Edges and circles are rows of numbers here: x, y, x, y of both ends; and x, y,
radius, 0 (m).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from roboglot.kernels import loading
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.building.blueprint import Solid, SolidKind, solids_of
from roboglot.simulation.building.props import Props
from roboglot.simulation.building.terrain import slices_of
from roboglot.simulation.building.things import Thing
from roboglot.simulation.people.people import Walker
from roboglot.simulation.world import reflections
from roboglot.simulation.world.description import Terrain, WorldDescription
from roboglot.simulation.world.sweep import Distances, blur, directions, sweep

KEPT_MAX = 64
Rows = NDArray[np.float64]  # n x 4
Four = tuple[float, float, float, float]


class Sight:
    """Casts rays for the sensors, always against the present places of moving objects."""

    def __init__(
        self,
        world: WorldDescription,
        hulls: Sequence[Hull],
        walkers: Sequence[Walker],
        props: Props,
        things: Iterable[Thing] = (),
    ) -> None:
        self._hulls, self._walkers, self._props, self._things = hulls, walkers, props, tuple(things)
        self._elevations = [world.elevation(number) for number in range(len(world.floors))]
        self._floors, self._plain, self._glossy = [], [], []
        for floor in world.floors:
            solids = solids_of(floor, world.lift, lift_here=True)
            still = [solid for solid in solids if solid.kind is not SolidKind.DOCK]
            self._floors.append(_Still(still))
            self._plain.append(_Still([solid for solid in still if solid.material == "plain"]))
            self._glossy.append([solid for solid in still if solid.material != "plain"])
        self._terrain = [floor.relief for floor in world.floors]
        self._dark: dict[tuple[int, float, float], tuple[Rows, Rows]] = {}  # by floor, height and share
        self._moving: dict[tuple[int, float], Rows] = {}  # objects around the robot that move, by floor and height
        self._cast: Callable[..., Distances] = _sweep
        self._turns: Callable[..., None] | None = None
        self.blur: Callable[..., NDArray[np.float32]] = blur
        self._edges: dict[tuple[int, float], tuple[int, Rows]] = {}  # by floor and height, with the props' revision

    def load_kernel(self) -> None:
        """Use the compiled kernel from now on; loading takes a second, or several to compile it first.

        Its distances equal numpy's up to rounding.
        """
        with loading():
            from roboglot.kernels import sweep as compiled

        self._cast, self.blur, self._turns = compiled.sweep, compiled.blur, compiled.turns

    def moved(self) -> None:
        """Forget where people and robots were."""
        self._moving.clear()

    def turn(self, hull: Hull, height: float, rays: int, reach: float, bearing: float = 0.0) -> Distances:
        """Return distances (m) of a full turn around ``hull``'s middle, ``height`` m above its floor; see ``sweep``.

        ``bearing``: direction of the middle ray, rad in base_link.
        """
        edges, circles = self._around(hull.floor, height)
        return self._cast(edges, circles, _ways(rays), hull.x, hull.y, hull.turned + bearing, reach)

    def turns(
        self, floor: int, height: float, eyes: Rows, readings: NDArray[np.float32], limits: tuple[float, ...]
    ) -> None:
        """Turn the noise in ``readings`` (n, rays) into blurred distances around ``eyes`` (n x 3: x, y, yaw).

        ``limits``: reach, and what ``blur`` takes. Needs ``many`` to be true.
        """
        assert self._turns is not None
        edges, circles = self._around(floor, height)
        self._turns(edges, circles, _ways(readings.shape[1]), eyes, readings, *limits)

    def many(self, floor: int, *, gloss: bool) -> bool:
        """Return whether ``turns`` can be used on a floor; ``gloss``: whether glass and mirrors count."""
        return self._turns is not None and not (gloss and self._glossy[floor])

    def _around(self, floor: int, height: float) -> tuple[Rows, Rows]:
        """Return the edges and circles that rays can meet at ``height``."""
        key = floor, round(height, 3)
        circles, kept = self._moving.get(key), self._edges.get(key)
        if circles is None:
            circles = self._moving[key] = self._circles_at(floor, height)
        if kept is None or kept[0] != self._props.revisions[floor]:
            kept = self._edges_with_props(key, height)
        edges, terrains = kept[1], self._terrain[floor]
        if terrains and (slopes := [solid for terrain in terrains for solid in _slopes_at(terrain, height)]):
            edges = np.concatenate((edges, _edges_at(slopes, height)))
        return edges, circles

    def dark(self, hull: Hull, height: float, rays: int, reach: float, share: float) -> Distances:
        """Return the distances as ``turn`` to the black pieces of still furniture only: ``share`` of all pieces."""
        key = hull.floor, round(height, 3), share
        kept = self._dark.get(key)
        if kept is None:
            every = max(1, round(1.0 / share))
            solids = [solid for solid in self._floors[hull.floor].solids if solid.kind is SolidKind.FURNITURE][::every]
            kept = self._dark[key] = _edges_at(solids, height), _circles_at(solids, height)
        return self._cast(*kept, _ways(rays), hull.x, hull.y, hull.turned, reach)

    def glossy(self, hull: Hull, height: float, rays: int, reach: float, exact: Distances) -> Distances:
        """Return the distances of a lidar's turn with glass and mirrors; ``exact``: those without reflections."""
        if not self._glossy[hull.floor]:
            return exact
        circles, ways = self._circles_at(hull.floor, height), _ways(rays)
        edges = np.concatenate((self._plain[hull.floor].at(height)[0], _edges_at(self._props.on(hull.floor), height)))
        behind = self._cast(edges, circles, ways, hull.x, hull.y, hull.turned, reach)
        glass, mirrors = (
            _edges_at([solid for solid in self._glossy[hull.floor] if solid.material == kind], height)
            for kind in ("glass", "mirror")
        )
        c, s = math.cos(hull.turned), math.sin(hull.turned)
        eye, there = np.array([[hull.x, hull.y]]), ways @ np.array([[c, s], [-s, c]])
        found = reflections.seen(behind, glass, mirrors, edges, circles, eye, there)
        found[found > reach] = np.inf
        return found

    def _edges_with_props(self, key: tuple[int, float], height: float) -> tuple[int, Rows]:
        """Return the revision of the props and the edges of still solids and props; cached until a prop moves."""
        floor = key[0]
        if len(self._edges) > KEPT_MAX:
            self._edges.clear()
        (edges, _), props = self._floors[floor].at(height), _edges_at(self._props.on(floor), height)
        kept = self._props.revisions[floor], np.concatenate((edges, props)) if len(props) else edges
        self._edges[key] = kept
        return kept

    def _circles_at(self, floor: int, height: float) -> Rows:
        """Return the circles of round solids and of everything that moves."""
        found: list[float] = []  # numpy reads a plain list twice as fast
        for walker in self._walkers:
            person = walker.person
            if walker.floor == floor and 0.0 < height < person.height:
                found += *walker.spot, _girth(person.radius, person.height, height), 0.0
        for hull in self._hulls:  # the observing robot is inside its own, which is invisible from inside
            if hull.floor == floor and hull.covers(height):
                found += hull.x, hull.y, hull.body.hull.radius, 0.0
        for thing in self._things:  # that no robot carries
            x, y, z = thing.position.tolist()
            if not thing.carried and z <= self._elevations[floor] + height < z + thing.height:
                found += x, y, thing.diameter / 2, 0.0
        _, circles = self._floors[floor].at(height)
        if not found:
            return circles
        rows = np.array(found).reshape(-1, 4)
        return np.concatenate((circles, rows)) if len(circles) else rows


def _sweep(edges: Rows, circles: Rows, ways: Rows, x: float, y: float, yaw: float, reach: float) -> Distances:
    """Sweep with numpy, whose plane vectors are complex numbers."""
    return sweep(edges.view(np.complex128), circles.view(np.complex128), x, y, yaw, len(ways), reach)


@lru_cache(maxsize=8)
def _ways(rays: int) -> Rows:
    """Return the unit vectors of a turn (n x 2: x, y)."""
    return directions(rays).view(np.float64).reshape(rays, 2)


@lru_cache(maxsize=256)
def _girth(radius: float, tall: float, height: float) -> float:
    """Return a person's radius at a height: people are capsules, narrower towards feet and crown."""
    off = max(0.0, radius - height, height - tall + radius)
    return math.sqrt(radius**2 - off**2)


def _rows(numbers: list[Four]) -> Rows:
    return np.array(numbers, dtype=np.float64).reshape(-1, 4)


class _Still:
    """The still solids of a floor, sliced by height; slices are cached, as heights change little."""

    def __init__(self, solids: list[Solid]) -> None:
        self.solids = solids
        heights = {solid.base for solid in solids} | {solid.base + solid.size[2] for solid in solids}
        self._steps = sorted(heights)
        self._slices: dict[int, tuple[Rows, Rows]] = {}

    def at(self, height: float) -> tuple[Rows, Rows]:
        """Return edges and circles at ``height`` m above the floor."""
        band = bisect_right(self._steps, height)
        if band not in self._slices:
            self._slices[band] = _edges_at(self.solids, height), _circles_at(self.solids, height)
        return self._slices[band]


def _slopes_at(terrain: Terrain, height: float) -> Iterator[Solid]:
    """Yield the parts of a ramp above ``height``, as boxes."""
    for middle, length, width in slices_of(terrain, height):
        yield Solid(SolidKind.FURNITURE, middle, (length, width, math.inf))


def _edges_at(solids: Sequence[Solid], height: float) -> Rows:
    """Return the edges of the boxes at ``height``, counter-clockwise around each."""
    edges: list[Four] = []
    for solid in solids:
        if solid.round or not solid.base <= height < solid.base + solid.size[2]:
            continue
        middle = complex(solid.pose.x, solid.pose.y)
        along = complex(math.cos(solid.pose.yaw), math.sin(solid.pose.yaw))
        x, y = along * solid.size[0] / 2, 1j * along * solid.size[1] / 2
        corners = (middle - x - y, middle + x - y, middle + x + y, middle - x + y)
        ends = zip(corners, (*corners[1:], corners[0]), strict=True)
        edges += [(start.real, start.imag, end.real, end.imag) for start, end in ends]
    return _rows(edges)


def _circles_at(solids: Sequence[Solid], height: float) -> Rows:
    """Return the circles of the cylinders at ``height``."""
    circles = [
        (solid.pose.x, solid.pose.y, solid.size[0] / 2, 0.0)
        for solid in solids
        if solid.round and solid.base <= height < solid.base + solid.size[2]
    ]
    return _rows(circles)
