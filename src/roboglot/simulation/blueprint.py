"""Turns a world's description into plain solids per floor: what one bumps into and what rays hit.

Pure geometry, in each floor's own plane (z from the floor's surface). Knows no simulator.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from roboglot.model.geometry import Pose
from roboglot.simulation.description import Box, Cylinder, Dock, Floor, Lift, Spot, Wall

DOCK_WIDTH, DOCK_DEPTH, DOCK_HEIGHT = 0.36, 0.12, 0.45
SHAFT_WALL = 0.10
OUTER_WALL = 0.20


class Kind(StrEnum):
    """What a solid is."""

    WALL = "wall"
    FURNITURE = "furniture"
    DOCK = "dock"
    LANDING_DOOR = "landing door"


@dataclass(frozen=True, slots=True)
class Solid:
    """A box (``size`` = width along its x, depth, height) or a standing cylinder (size = (diameter, diameter, height)).

    ``pose`` is the middle of its footprint, ``base`` the height of its underside.
    """

    kind: Kind
    pose: Pose
    size: tuple[float, float, float]
    base: float = 0.0
    round: bool = False


@dataclass(frozen=True, slots=True)
class Rectangle:
    """An axis-parallel piece of floor, m."""

    x: float
    y: float
    width: float
    depth: float


def solids_of(floor: Floor, lift: Lift | None, lift_here: bool) -> Iterator[Solid]:
    """All that stands still on one floor. ``lift_here``: the car is parked here, so the landing door is open."""
    if floor.enclosed:
        yield from _enclosure(floor)
    for wall in floor.walls:
        for start, end in _pieces(wall):
            yield _wall_between(start, end, wall.thickness, floor.height)
    for thing in floor.furniture:
        yield _furniture(thing)
    for dock in floor.docks:
        yield _dock(dock)
    if lift is not None:
        yield from _shaft(lift, floor.height, lift_here)


def slabs_of(floor: Floor, lift: Lift | None) -> Iterator[Rectangle]:
    """The floor's surface as rectangles that leave the lift's shaft open."""
    x0, y0 = floor.origin
    x1, y1 = x0 + floor.size[0], y0 + floor.size[1]
    if lift is None:
        yield Rectangle(x0, y0, x1 - x0, y1 - y0)
        return
    c, s = abs(math.cos(math.radians(lift.facing))), abs(math.sin(math.radians(lift.facing)))
    half_x = (c * lift.size[0] + s * lift.size[1]) / 2
    half_y = (s * lift.size[0] + c * lift.size[1]) / 2
    left, right = lift.at[0] - half_x, lift.at[0] + half_x
    low, high = lift.at[1] - half_y, lift.at[1] + half_y
    for a, b, c_, d in (
        (x0, y0, left, y1),
        (right, y0, x1, y1),
        (left, y0, right, low),
        (left, high, right, y1),
    ):
        if c_ - a > 1e-6 and d - b > 1e-6:
            yield Rectangle(a, b, c_ - a, d - b)


def _enclosure(floor: Floor) -> Iterator[Solid]:
    """Walls around the floor, their inner faces on its edge."""
    (x0, y0), (width, depth) = floor.origin, floor.size
    h, t = OUTER_WALL / 2, OUTER_WALL
    x1, y1 = x0 + width, y0 + depth
    yield _wall_between((x0 - t, y0 - h), (x1 + t, y0 - h), t, floor.height)
    yield _wall_between((x0 - t, y1 + h), (x1 + t, y1 + h), t, floor.height)
    yield _wall_between((x0 - h, y0), (x0 - h, y1), t, floor.height)
    yield _wall_between((x1 + h, y0), (x1 + h, y1), t, floor.height)


def _pieces(wall: Wall) -> Iterator[tuple[Spot, Spot]]:
    """The wall without its doors."""
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


def _wall_between(start: Spot, end: Spot, thickness: float, height: float) -> Solid:
    middle = Pose((start[0] + end[0]) / 2, (start[1] + end[1]) / 2, math.atan2(end[1] - start[1], end[0] - start[0]))
    return Solid(Kind.WALL, middle, (math.dist(start, end), thickness, height))


def _furniture(thing: Box | Cylinder) -> Solid:
    match thing:
        case Box():
            pose = Pose(*thing.at, math.radians(thing.facing))
            return Solid(Kind.FURNITURE, pose, thing.size, thing.base)
        case Cylinder():
            size = (2 * thing.radius, 2 * thing.radius, thing.height)
            return Solid(Kind.FURNITURE, Pose(*thing.at), size, thing.base, round=True)


def _dock(dock: Dock) -> Solid:
    middle = dock.pose.compose(Pose(-DOCK_DEPTH / 2))
    return Solid(Kind.DOCK, middle, (DOCK_DEPTH, DOCK_WIDTH, DOCK_HEIGHT))


def _shaft(lift: Lift, height: float, open_door: bool) -> Iterator[Solid]:
    """Three walls around the car, and a front wall with the landing door."""
    frame = Pose(*lift.at, math.radians(lift.facing))
    deep, wide = lift.size
    t = SHAFT_WALL

    def box(x: float, y: float, size_x: float, size_y: float, kind: Kind = Kind.WALL) -> Solid:
        return Solid(kind, frame.compose(Pose(x, y)), (size_x, size_y, height))

    yield box(-deep / 2 - t / 2, 0, t, wide + 2 * t)
    yield box(0, wide / 2 + t / 2, deep, t)
    yield box(0, -wide / 2 - t / 2, deep, t)
    jamb = (wide + 2 * t - lift.door_width) / 2
    for side in (-1, 1):
        yield box(deep / 2 + t / 2, side * (lift.door_width + jamb) / 2, t, jamb)
    if not open_door:
        yield box(deep / 2 + t / 2, 0, t, lift.door_width, Kind.LANDING_DOOR)
