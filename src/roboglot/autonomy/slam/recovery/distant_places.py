"""Confirmation of places that a search found far from the believed pose."""

from __future__ import annotations

import math

from roboglot.model.geometry import Pose

NEAR = 1.5  # m from the believed place up to which a place is not distant
SAME, SAME_YAW = 0.3, math.radians(10.0)  # m, rad between two searches' places up to which they are one


class DistantPlaces:
    """Places far from the believed one: each is certain once two searches in a row have found it.

    One search is not enough: while people leave a bare corridor, its mirror image may fit better for a moment.
    """

    def __init__(self) -> None:
        self._map_to_odom: Pose | None = None  # according to the last search

    def forget(self) -> None:
        """Forget the place that the last search found."""
        self._map_to_odom = None

    def add(self, found: Pose, odometry: Pose) -> bool:
        """Add the place that a search ``found`` (map) at ``odometry`` (odom); return whether the last one agrees."""
        before, self._map_to_odom = self._map_to_odom, found.compose(odometry.inverse())
        return before is not None and before.compose(odometry).is_near(found, SAME, SAME_YAW)
