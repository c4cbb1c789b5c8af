"""Detection and tracking of single things among the lidar's points. Knows no robot.

Points are (n, 2) in base_link, m.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Point

LINK = 0.15  # m between neighbouring points of one object
WIDE_MAX = 1.2  # m across an object; anything wider is a wall
REACH = 0.4  # m around the expected place that are searched, from scan to scan

Points = NDArray[np.float64]


def thing_at(points: Points, place: Point) -> Point | None:
    """Return the middle of the thing at ``place``; None: there is none, or it is too wide."""
    cluster = _cluster(points, place, 2.0 * WIDE_MAX)
    if cluster is None or float(np.hypot(*np.ptp(cluster, axis=0))) > WIDE_MAX:
        return None
    return _middle(cluster)


def moved_thing(points: Points, place: Point) -> Point | None:
    """Return the middle of the thing that was at ``place`` one scan ago, without a wall near it; None: not found."""
    cluster = _cluster(points, place, REACH + WIDE_MAX / 2)
    return None if cluster is None else _middle(cluster)


def _cluster(points: Points, place: Point, within: float) -> Points | None:
    """Return the cluster around the point nearest to ``place``, up to ``within`` m away; None: nothing is near."""
    away = np.hypot(points[:, 0] - place.x, points[:, 1] - place.y)
    near = points[away <= within]
    if not len(near) or away.min() > REACH:
        return None
    linked = np.hypot(*(near[:, None] - near[None]).transpose(2, 0, 1)) <= LINK
    inside = np.hypot(near[:, 0] - place.x, near[:, 1] - place.y) <= away.min()
    while (grown := linked[inside].any(axis=0)).sum() > inside.sum():
        inside = grown
    cluster: Points = near[inside]
    return cluster


def _middle(cluster: Points) -> Point:
    x, y = cluster.mean(axis=0).tolist()
    return Point(x, y)
