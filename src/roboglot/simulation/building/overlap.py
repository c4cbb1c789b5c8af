"""Test of two standing solids for overlap. Pure geometry, in one floor's plane."""

from __future__ import annotations

import math

from roboglot.model.geometry import Pose
from roboglot.simulation.building.blueprint import Solid


def overlap(a: Solid, b: Solid) -> bool:
    """True if a point lies inside both; touching does not count."""
    if a.base >= b.base + b.size[2] or b.base >= a.base + a.size[2]:
        return False
    away = a.pose.distance_to(b.pose)
    if away >= reach_of(a) + reach_of(b):
        return False
    if a.round and b.round:
        return True
    if a.round:
        a, b = b, a
    if b.round:
        seen = b.pose.relative_to(a.pose)
        beside = max(0.0, abs(seen.x) - a.size[0] / 2), max(0.0, abs(seen.y) - a.size[1] / 2)
        return math.hypot(*beside) < b.size[0] / 2
    return not (_apart(a, b.pose.relative_to(a.pose), b) or _apart(b, a.pose.relative_to(b.pose), a))


def reach_of(solid: Solid) -> float:
    """Return the distance from the middle to the farthest point of the footprint, m."""
    return solid.size[0] / 2 if solid.round else math.hypot(solid.size[0], solid.size[1]) / 2


def _apart(box: Solid, seen: Pose, other: Solid) -> bool:
    """True if one of ``box``'s sides separates it from ``other``; ``seen``: the other's place from its middle."""
    c, s = abs(math.cos(seen.yaw)), abs(math.sin(seen.yaw))
    width, depth = other.size[0] * c + other.size[1] * s, other.size[0] * s + other.size[1] * c
    return abs(seen.x) >= (box.size[0] + width) / 2 or abs(seen.y) >= (box.size[1] + depth) / 2
