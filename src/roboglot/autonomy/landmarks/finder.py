"""Pose from landmarks, by matching the lidar's strips to known landmarks. Knows no robot; m and rad."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import permutations

from roboglot.model.geometry import Point, Pose, wrap_angle

SPAN_SLACK, FIT = 0.08, 0.15  # m: between two distances; between a strip and its landmark
SAME, SAME_YAW = 0.3, 0.15  # difference of two answers that count as one
STRIPS_MIN = 3  # two strips fit in two ways, so at least three


def pose_by_landmarks(seen: Sequence[Point], known: Sequence[Point]) -> Pose | None:
    """Return base_link in map that matches all strips (base_link) to landmarks (map); None: none, or ambiguous."""
    if len(seen) < STRIPS_MIN:
        return None
    a, b = _widest(seen)
    span, answers = a.distance_to(b), list[Pose]()
    for one, other in permutations(known, 2):
        if abs(one.distance_to(other) - span) > SPAN_SLACK:
            continue
        pose = _pose(a, b, one, other)
        if all(min(pose.compose(Pose(p.x, p.y)).point.distance_to(mark) for mark in known) < FIT for p in seen):
            answers.append(pose)
    if not answers or any(not _same(answer, answers[0]) for answer in answers):
        return None
    return answers[0]


def _widest(points: Sequence[Point]) -> tuple[Point, Point]:
    pairs = [(a, b) for index, a in enumerate(points) for b in points[index + 1 :]]
    return max(pairs, key=lambda pair: pair[0].distance_to(pair[1]))


def _pose(a: Point, b: Point, one: Point, other: Point) -> Pose:
    """Return the pose that best maps ``a`` and ``b`` to the two landmarks."""
    yaw = wrap_angle(one.bearing_to(other) - a.bearing_to(b))
    c, s = math.cos(yaw), math.sin(yaw)
    x, y = (a.x + b.x) / 2, (a.y + b.y) / 2
    return Pose((one.x + other.x) / 2 - c * x + s * y, (one.y + other.y) / 2 - s * x - c * y, yaw)


def _same(a: Pose, b: Pose) -> bool:
    return a.distance_to(b) < SAME and abs(wrap_angle(a.yaw - b.yaw)) < SAME_YAW
