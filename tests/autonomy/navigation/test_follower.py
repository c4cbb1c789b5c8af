"""The follower of a route."""

from __future__ import annotations

import numpy as np
import pytest

from roboglot.autonomy.navigation.follower import PERIOD, Follower
from roboglot.autonomy.navigation.route import Route
from roboglot.model.components.motion.base import BaseLimits
from roboglot.model.geometry import Point, Pose, Twist

TOP = 1.2  # m/s


@pytest.mark.parametrize("holonomic", [True, False], ids=["holonomic", "differential"])
def test_a_stop_for_a_moment_costs_little(*, holonomic: bool) -> None:
    """A base brakes at its own rate: after one period it is still nearly as fast."""
    limits = BaseLimits(
        twist=Twist(TOP, TOP * holonomic, 1.8), linear_acceleration=0.8, angular_acceleration=3.0, holonomic=holonomic
    )
    route = Route([np.array([(0.0, 0.0), (8.0, 0.0)])], [Point(8.0, 0.0)], 0.05)
    route.set_speeds(np.full(len(route.points), TOP), limits.linear_acceleration)
    follower, pose, speed, speeds = Follower(limits, TOP, route), Pose(), 0.0, list[float]()
    for step in range(60):
        follower.locate(pose)
        follower.stop_at = follower.along if step == 40 else 100.0
        asked, most = follower.command(pose).x, limits.linear_acceleration * PERIOD
        assert step != 40 or asked == 0.0
        speed += max(-most, min(most, asked - speed))
        speeds.append(speed)
        pose = pose.compose(Pose(speed * PERIOD))
    assert speeds[39] > 1.1
    assert min(speeds[40:]) > 1.1
