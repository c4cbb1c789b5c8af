"""Places that a search found far from where the robot believes to be."""

from __future__ import annotations

import math

from roboglot.model.geometry import Pose

NEAR = 1.5  # m from the believed place up to which a place is not distant
SAME, SAME_YAW = 0.3, math.radians(10.0)  # m, rad between two searches' places up to which they are one


class DistantPlaces:
    """Places far from the believed one, each found by a search; certain once the next search has found it, too.

    While others leave a bare corridor, its mirror image may fit better for a moment.
    """

    def __init__(self) -> None:
        self._map_to_odom: Pose | None = None  # by the place that the last search found

    def forget(self) -> None:
        """Forget what was found."""
        self._map_to_odom = None

    def add(self, found: Pose, odometry: Pose) -> bool:
        """Note a place that was found; return whether the search before had found it, too."""
        before, self._map_to_odom = self._map_to_odom, found.compose(odometry.inverse())
        return before is not None and before.compose(odometry).is_near(found, SAME, SAME_YAW)
