"""Turns a world's description into plain solids per floor, for collisions and rays.

Pure geometry, in each floor's own plane (z from the floor's surface). Knows no simulator.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from enum import StrEnum

from roboglot.model.geometry import Pose
from roboglot.simulation.building.keeping import kept
from roboglot.simulation.world.description import Box, Cylinder, Floor, Lift, Material, Person, Shelf, Spot, Wall
from roboglot.values import dataclass

DOCK_WIDTH, DOCK_DEPTH, DOCK_HEIGHT = 0.36, 0.12, 0.45
SHAFT_WALL = 0.10
OUTER_WALL = 0.20
SHELF_LEG = 0.04
FLOORS_MAX = 64  # whose solids are kept: a world's parts each ask for those of all its floors


class SolidKind(StrEnum):
    """Kind of a solid."""

    WALL = "wall"
    FURNITURE = "furniture"
    DOCK = "dock"
    LANDING_DOOR = "landing door"
    SHELF = "shelf"
    PERSON = "person"


@dataclass(frozen=True, slots=True)
class Solid:
    """A box (``size`` = width along its x, depth, height) or a standing cylinder (size = (diameter, diameter, height)).

    ``pose`` is the middle of its footprint, ``base`` the height of its underside.
    """

    kind: SolidKind
    pose: Pose
    size: tuple[float, float, float]
    base: float = 0.0
    round: bool = False
    material: Material = "plain"


@dataclass(frozen=True, slots=True)
class Rectangle:
    """An axis-parallel piece of floor, m."""

    x: float
    y: float
    width: float
    depth: float

    def distance_to(self, x: float, y: float) -> float:
        """Return the distance from its edge to a point outside, m; 0 inside."""
        dx = max(self.x - x, 0.0, x - self.x - self.width)
        dy = max(self.y - y, 0.0, y - self.y - self.depth)
        return math.hypot(dx, dy)


@kept(FLOORS_MAX)
def solids_of(floor: Floor, lift: Lift | None, lift_here: bool) -> tuple[Solid, ...]:
    """Return all still solids of one floor. ``lift_here``: the car is parked here, so the landing door is open."""
    return tuple(_solids(floor, lift, lift_here))


def _solids(floor: Floor, lift: Lift | None, lift_here: bool) -> Iterator[Solid]:
    if floor.enclosed:
        yield from _enclosure(floor)
    for wall in floor.walls:
        for start, end in _pieces(wall):
            yield _wall_between(start, end, wall.thickness, floor.height, wall.material)
    for thing in floor.furniture:
        yield _furniture(thing)
    for dock in floor.docks:
        yield dock_solid(dock.pose)
    if lift is not None:
        yield from _shaft(lift, floor.height, lift_here)


def slabs_of(floor: Floor, lift: Lift | None) -> Iterator[Rectangle]:
    """Yield the floor's surface as rectangles, without the lift's shaft and the holes."""
    slabs = [Rectangle(*floor.origin, *floor.size)]
    for gap in ([shaft_of(lift)] if lift else []) + holes_of(floor):
        slabs = [piece for slab in slabs for piece in _without(slab, gap)]
    yield from slabs


def shaft_of(lift: Lift) -> Rectangle:
    """Return the lift car's floor (world)."""
    c, s = abs(math.cos(math.radians(lift.facing))), abs(math.sin(math.radians(lift.facing)))
    width, depth = c * lift.size[0] + s * lift.size[1], s * lift.size[0] + c * lift.size[1]
    return Rectangle(lift.at[0] - width / 2, lift.at[1] - depth / 2, width, depth)


def holes_of(floor: Floor) -> list[Rectangle]:
    """Return the holes in a floor (world)."""
    return [Rectangle(h.at[0] - h.size[0] / 2, h.at[1] - h.size[1] / 2, *h.size) for h in floor.holes]


def _without(slab: Rectangle, gap: Rectangle) -> Iterator[Rectangle]:
    """Yield the rest of the slab left and right of the gap, and below and above it between them."""
    right, top = slab.x + slab.width, slab.y + slab.depth
    left_end, right_end = (min(max(x, slab.x), right) for x in (gap.x, gap.x + gap.width))
    low, high = (min(max(y, slab.y), top) for y in (gap.y, gap.y + gap.depth))
    for x0, y0, x1, y1 in (
        (slab.x, slab.y, left_end, top),
        (right_end, slab.y, right, top),
        (left_end, slab.y, right_end, low),
        (left_end, high, right_end, top),
    ):
        if x1 - x0 > 1e-6 and y1 - y0 > 1e-6:
            yield Rectangle(x0, y0, x1 - x0, y1 - y0)


def _enclosure(floor: Floor) -> Iterator[Solid]:
    """Yield the walls around the floor, their inner faces on its edge."""
    (x0, y0), (width, depth) = floor.origin, floor.size
    h, t = OUTER_WALL / 2, OUTER_WALL
    x1, y1 = x0 + width, y0 + depth
    yield _wall_between((x0 - t, y0 - h), (x1 + t, y0 - h), t, floor.height)
    yield _wall_between((x0 - t, y1 + h), (x1 + t, y1 + h), t, floor.height)
    yield _wall_between((x0 - h, y0), (x0 - h, y1), t, floor.height)
    yield _wall_between((x1 + h, y0), (x1 + h, y1), t, floor.height)


def _pieces(wall: Wall) -> Iterator[tuple[Spot, Spot]]:
    """Yield the ends of the wall's pieces between its doors."""
    (ax, ay), (bx, by) = wall.start, wall.end
    length = wall.length

    def at(distance: float) -> Spot:
        part = distance / length
        return ax + (bx - ax) * part, ay + (by - ay) * part

    done = 0.0
    for door in sorted(wall.doors, key=lambda opening: opening.at):
        if door.at - door.width / 2 > done:
            yield at(done), at(door.at - door.width / 2)
        done = max(done, door.at + door.width / 2)
    if done < length:
        yield at(done), at(length)


def _wall_between(start: Spot, end: Spot, thickness: float, height: float, material: Material = "plain") -> Solid:
    middle = Pose((start[0] + end[0]) / 2, (start[1] + end[1]) / 2, math.atan2(end[1] - start[1], end[0] - start[0]))
    return Solid(SolidKind.WALL, middle, (math.dist(start, end), thickness, height), material=material)


def _furniture(thing: Box | Cylinder) -> Solid:
    match thing:
        case Box():
            pose = Pose(*thing.at, math.radians(thing.facing))
            return Solid(SolidKind.FURNITURE, pose, thing.size, thing.base, material=thing.material)
        case Cylinder():
            size = (2 * thing.radius, 2 * thing.radius, thing.height)
            return Solid(SolidKind.FURNITURE, Pose(*thing.at), size, thing.base, round=True)


def dock_solid(front: Pose) -> Solid:
    """Return a charging dock with the middle of its front at ``front``, +x away from it."""
    middle = front.compose(Pose(-DOCK_DEPTH / 2))
    return Solid(SolidKind.DOCK, middle, (DOCK_DEPTH, DOCK_WIDTH, DOCK_HEIGHT))


def door_panels(lift: Lift, height: float, opening: float) -> Iterator[Solid]:
    """Yield both halves of a landing door, moved into the jambs by ``opening`` (0..1)."""
    frame, left = Pose(*lift.at, math.radians(lift.facing)), (1.0 - opening) * lift.door_width / 2
    for side in (1, -1):
        y = side * (lift.door_width - left) / 2
        size = (SHAFT_WALL, left, height)
        yield Solid(SolidKind.LANDING_DOOR, frame.compose(Pose((lift.size[0] + SHAFT_WALL) / 2, y)), size)


def shelf_solids(shelf: Shelf, pose: Pose, lifted: float) -> Iterator[Solid]:
    """Yield four legs, then the board with its goods, ``lifted`` m above the floor."""
    width, depth = shelf.size
    for x in (-1, 1):
        for y in (-1, 1):
            corner = pose.compose(Pose(x * (width - SHELF_LEG) / 2, y * (depth - SHELF_LEG) / 2))
            yield Solid(SolidKind.SHELF, corner, (SHELF_LEG, SHELF_LEG, shelf.clearance), lifted)
    yield Solid(SolidKind.SHELF, pose, (width, depth, shelf.height - shelf.clearance), lifted + shelf.clearance)


def _shaft(lift: Lift, height: float, open_door: bool) -> Iterator[Solid]:
    """Yield three walls around the car, and a front wall with the landing door."""
    frame = Pose(*lift.at, math.radians(lift.facing))
    deep, wide = lift.size
    t = SHAFT_WALL

    def box(x: float, y: float, size_x: float, size_y: float, kind: SolidKind = SolidKind.WALL) -> Solid:
        return Solid(kind, frame.compose(Pose(x, y)), (size_x, size_y, height))

    yield box(-deep / 2 - t / 2, 0, t, wide + 2 * t)
    yield box(0, wide / 2 + t / 2, deep, t)
    yield box(0, -wide / 2 - t / 2, deep, t)
    jamb = (wide + 2 * t - lift.door_width) / 2
    for side in (-1, 1):
        yield box(deep / 2 + t / 2, side * (lift.door_width + jamb) / 2, t, jamb)
    if not open_door:
        yield box(deep / 2 + t / 2, 0, t, lift.door_width, SolidKind.LANDING_DOOR)


def person_solid(person: Person, pose: Pose) -> Solid:
    """Return a person who stands there."""
    return Solid(SolidKind.PERSON, pose, (2 * person.radius, 2 * person.radius, person.height), round=True)
