"""Boards and shelves in a scan, by their shapes. Knows no robot.

All points and poses are in base_link, m; a mark's +x points out of its front, towards the robot.
"""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.docking.dock_finder import front_of, things_of
from roboglot.model.geometry import Point, Pose, wrap_angle
from roboglot.model.perception import ReflectorSeen

REACH = 3.0  # m
AHEAD = math.radians(60.0)  # to either side of the robot's heading
LEG_MAX, LEG_HALF = 0.09, 0.02  # m: the widest echo of a leg; the distance from its face to its centre
LEGS_MAX = 24  # leg-sized objects examined, nearest first
SIDE_MIN, SIDE_MAX = 0.4, 1.5  # m between legs
SQUARE = 0.05  # m by which a leg may miss its corner
MARGIN = 0.1  # m inside the legs that must be empty

Points = NDArray[np.float64]


def find_board(points: Points) -> Pose | None:
    """Return the pose of the nearest board ahead that faces the robot; None: there is none."""
    near = points[np.hypot(points[:, 0], points[:, 1]) < REACH]
    best: Pose | None = None
    for thing in things_of(near):
        x, y = thing.mean(axis=0).tolist()
        if abs(math.atan2(y, x)) > AHEAD:
            continue
        front = front_of(thing, math.atan2(-y, -x), math.radians(50.0))
        if front is not None and (best is None or math.hypot(front.x, front.y) < math.hypot(best.x, best.y)):
            best = front
    return best


def find_shelf(points: Points) -> tuple[Pose, float] | None:
    """Return the middle of the nearest four legs with nothing between, and its distance to the front, m; or None."""
    near = points[np.hypot(points[:, 0], points[:, 1]) < REACH]
    legs = legs_of(near)
    best: tuple[Pose, float] | None = None
    for a, b in combinations(legs, 2):
        left, right = (a, b) if a.y > b.y else (b, a)
        for found in _rectangles(left, right, legs):
            middle, half_depth, half_width = found
            if (best is None or middle.x < best[0].x) and _empty(near, middle, half_depth, half_width):
                best = middle, half_depth + LEG_HALF
    return best


def legs_of(points: Points) -> list[Point]:
    """Return the middles of thin things, nearest first."""
    legs: list[Point] = []
    for thing in things_of(points):
        if float(np.hypot(*(thing.max(axis=0) - thing.min(axis=0)))) <= LEG_MAX:
            x, y = thing.mean(axis=0).tolist()
            away = math.hypot(x, y)
            legs.append(Point(x * (1.0 + LEG_HALF / away), y * (1.0 + LEG_HALF / away)))
    return sorted(legs, key=lambda leg: math.hypot(leg.x, leg.y))[:LEGS_MAX]


def _rectangles(left: Point, right: Point, legs: list[Point]) -> list[tuple[Pose, float, float]]:
    """Return rectangles with these two as front legs: middle, half the depth, half the width (m)."""
    width = left.distance_to(right)
    if not SIDE_MIN <= width <= SIDE_MAX:
        return []
    out = wrap_angle(right.bearing_to(left) + math.pi / 2)  # towards the robot
    front = Pose((left.x + right.x) / 2, (left.y + right.y) / 2, out)
    if front.x <= 0.0 or abs(wrap_angle(out - math.atan2(-front.y, -front.x))) > AHEAD:
        return []
    seen = [Pose(leg.x, leg.y).relative_to(front) for leg in legs]
    sides = {
        side: [leg for leg in seen if abs(leg.y - side * width / 2) < SQUARE and SIDE_MIN <= -leg.x <= SIDE_MAX]
        for side in (-1, 1)
    }
    found = []
    for one in sides[-1]:
        for other in sides[1]:
            if abs(one.x - other.x) < SQUARE:
                depth = -(one.x + other.x) / 2
                turn = math.atan2(-(one.y + other.y) / 2, depth)  # the rear legs sharpen the direction
                middle = front.compose(Pose(-depth / 2, (one.y + other.y) / 4, turn))
                found.append((middle, depth / 2, width / 2))
    return found


def _empty(points: Points, middle: Pose, half_depth: float, half_width: float) -> bool:
    """True if no echo comes from between the legs."""
    c, s = math.cos(middle.yaw), math.sin(middle.yaw)
    seen = (points - (middle.x, middle.y)) @ np.array([[c, -s], [s, c]])
    inside = (np.abs(seen[:, 0]) < half_depth - MARGIN) & (np.abs(seen[:, 1]) < half_width - MARGIN)
    return not bool(inside.any())


def between_strips(strips: tuple[ReflectorSeen, ...]) -> Pose:
    """Return the middle of strips, +x square to their line, or towards the robot for a single one."""
    x = sum(strip.place.x for strip in strips) / len(strips)
    y = sum(strip.place.y for strip in strips) / len(strips)
    yaw = math.atan2(-y, -x)
    if len(strips) > 1:
        places = sorted((strip.place for strip in strips), key=lambda place: place.y)
        square = places[0].bearing_to(places[-1]) + math.pi / 2
        yaw = square if math.cos(square - yaw) > 0 else square + math.pi
    return Pose(x, y, wrap_angle(yaw))
