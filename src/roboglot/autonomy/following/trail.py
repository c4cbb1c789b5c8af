"""The way around obstacles to the followed person: the person's own trail, or a gap beside the obstacle.

Knows no robot: points and poses are in odom or base_link as noted, m and rad.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Point, Pose

STEP = 0.15  # m between two points of a trail
STEPS_MAX = 200
HEADINGS = 48  # directions tried, all around
SIDEWAYS_COST = 1.0  # of a radian away from the goal, relative to a metre of room
TURN_COST = 0.35  # of a radian away from the last direction
ROOM_WANTED = 1.5  # m: more room than this has no further value
SLACK = 0.06  # m of clearance beyond the hull's radius

Points = NDArray[np.float64]


class Trail:
    """Points of the person's way (odom), oldest first, which is free of obstacles."""

    def __init__(self) -> None:
        self._points: list[Point] = []

    def add(self, place: Point) -> None:
        """Add the person's present place (odom)."""
        if not self._points or self._points[-1].distance_to(place) > STEP:
            self._points.append(place)
            del self._points[:-STEPS_MAX]

    def aim(self, here: Pose, seen: Points, radius: float) -> Point | None:
        """Return the newest point of the trail with a free straight way to it; None: none. ``seen``: in base_link."""
        for index in range(len(self._points) - 1, -1, -1):
            point = self._points[index]
            ahead = Pose(point.x, point.y).relative_to(here)
            away = math.hypot(ahead.x, ahead.y)
            if away > STEP and room(seen, radius, math.atan2(ahead.y, ahead.x)) >= away - radius:
                return point
        return None


def room(seen: Points, radius: float, heading: float) -> float:
    """Return the free distance of a hull towards ``heading`` (rad) before the ``seen`` points (base_link), m."""
    along = seen @ np.array([math.cos(heading), math.sin(heading)])
    beside = np.abs(seen @ np.array([-math.sin(heading), math.cos(heading)]))
    ahead = along[(beside < radius + SLACK) & (along > 0.0)]
    return float(ahead.min()) - radius if len(ahead) else math.inf


def gap(seen: Points, radius: float, heading: float, last: float | None) -> float | None:
    """Return the free direction nearest to ``heading`` and to ``last`` (rad, base_link); None: there is none."""
    best, least = None, math.inf
    for step in range(HEADINGS):
        tried = heading + step * math.tau / HEADINGS
        free = min(ROOM_WANTED, room(seen, radius, tried))
        if free < radius:
            continue
        cost = SIDEWAYS_COST * abs(math.remainder(tried - heading, math.tau)) - free
        if last is not None:
            cost += TURN_COST * abs(math.remainder(tried - last, math.tau))
        if cost < least:
            best, least = math.remainder(tried, math.tau), cost
    return best
