"""Whether a place that a search of the whole map found replaces the believed one, of a robot that is not lost."""

from __future__ import annotations

import math

from roboglot.autonomy.slam.matcher import Match
from roboglot.model.geometry import Pose, wrap_angle

NEAR, BETTER = 1.5, 0.08  # m; the gain in agreement that another place needs over the believed one
SAME, SAME_YAW = 0.3, math.radians(10.0)  # m, rad between two searches' places up to which they are one


class Elsewhere:
    """Memory of the distant place that the last search found."""

    def __init__(self) -> None:
        self._map_to_odom: Pose | None = None

    def forget(self) -> None:
        """Forget it: the scans fit again where the robot believes to be."""
        self._map_to_odom = None

    def replaces(
        self, found: Match, odometry: Pose, believed: Pose, agreement: float, *, given: bool, stood: bool
    ) -> bool:
        """Return whether to believe ``found`` instead of ``believed``, whose ``agreement`` is given.

        A distant place has to be found twice: while others leave a bare corridor, its mirror image may fit better for
        a moment. A robot on its way amid others that move along fits best where it was: nearby places count if it
        ``stood`` or its pose was ``given``.
        """
        near = found.pose.distance_to(believed) < NEAR
        if not (near if given else not near or stood) or found.agreement < agreement + BETTER:
            return False
        if near:
            return True
        before, self._map_to_odom = self._map_to_odom, found.pose.compose(odometry.inverse())
        return before is not None and _is_same(before.compose(odometry), found.pose)


def _is_same(one: Pose, other: Pose) -> bool:
    return one.distance_to(other) < SAME and abs(wrap_angle(one.yaw - other.yaw)) < SAME_YAW
