"""Docks in a lidar's scan: a flat front of known width that stands out from its background. Knows no robot."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Pose, wrap_angle

WIDTH, WIDTH_SLACK = 0.36, 0.06  # m
GAP = 0.07  # m between neighbouring echoes at which one object ends
STRAIGHT = 0.015  # m RMS from the line through the front
ECHOES_MIN = 6
MOVED_MAX, TURNED_MAX = 0.4, math.radians(25.0)  # from the dock's known place: m, rad
REACH = 2.0  # m around the robot that are examined
SEARCH_REACH = 2.5  # m around the robot, when the dock's place is unknown
OBLIQUE_MAX = math.radians(70.0)  # between a front and the line of sight

Echoes = NDArray[np.float64]


def find_dock(points: Echoes, expected: Pose) -> Pose | None:
    """Return the middle of the dock's front nearest to ``expected``, +x away from it, in the same frame; None: none.

    ``points`` (n, 2; m) are a scan's echoes in the order of their angle.
    """
    near = points[np.hypot(points[:, 0], points[:, 1]) < REACH]
    best, best_away = None, math.inf
    for thing in things_of(near):
        front = front_of(thing, expected.yaw, TURNED_MAX)
        if front is not None and front.distance_to(expected) < best_away:
            best, best_away = front, front.distance_to(expected)
    return best if best_away <= MOVED_MAX else None


def dock_fronts(points: Echoes) -> list[Pose]:
    """Return all possible dock fronts within SEARCH_REACH, nearest first, +x away from the dock; in base_link.

    ``points`` (n, 2; m, base_link) are a scan's echoes in the order of their angle.
    """
    fronts = []
    for thing in things_of(points[np.hypot(points[:, 0], points[:, 1]) < SEARCH_REACH]):
        x, y = thing.mean(axis=0).tolist()
        front = front_of(thing, math.atan2(-y, -x), OBLIQUE_MAX)
        if front is not None:
            fronts.append(front)
    return sorted(fronts, key=lambda front: math.hypot(front.x, front.y))


def things_of(echoes: Echoes) -> list[Echoes]:
    """Return the echoes of single things, split at gaps between neighbours."""
    if len(echoes) < ECHOES_MIN:
        return []
    steps = np.hypot(*np.diff(echoes, axis=0, append=echoes[:1]).T)
    breaks = np.flatnonzero(steps > GAP) + 1
    if not len(breaks):
        return []
    around = np.roll(echoes, -breaks[0], axis=0)  # an object may straddle the start of the scan
    return [thing for thing in np.split(around, breaks[1:] - breaks[0]) if len(thing)]


def front_of(thing: Echoes, facing: float, slack: float) -> Pose | None:
    """Return the pose of a flat thing as wide as a dock that faces ``facing`` +- ``slack`` (rad); None: it is not."""
    if len(thing) < ECHOES_MIN or math.hypot(*(thing[-1] - thing[0]).tolist()) > WIDTH + WIDTH_SLACK:
        return None
    middle = thing.mean(axis=0)
    spread = (thing - middle).T @ (thing - middle) / len(thing)
    shortest, longest = np.linalg.eigh(spread)[1].T
    away = (thing - middle) @ shortest
    along = (thing - middle) @ longest
    width = float(along.max() - along.min())
    if abs(width - WIDTH) > WIDTH_SLACK or float(np.sqrt((away**2).mean())) > STRAIGHT:
        return None
    yaw = math.atan2(shortest[1], shortest[0])
    if abs(wrap_angle(yaw - facing)) > math.pi / 2:
        yaw = wrap_angle(yaw + math.pi)
    if abs(wrap_angle(yaw - facing)) > slack:
        return None
    x, y = (middle + longest * (along.max() + along.min()) / 2).tolist()
    return Pose(x, y, yaw)
