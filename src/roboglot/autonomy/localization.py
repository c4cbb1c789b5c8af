"""Localization from Lidar and Odometry: the component. The estimator that moves the belief is slam.py's."""

from __future__ import annotations

import math

from roboglot.autonomy.belief import Belief
from roboglot.model.components.localization import Localization
from roboglot.model.errors import InvalidGoal
from roboglot.model.events import PoseJumped
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.robot import Robot

POSITION_MAX = 10_000.0  # m from the origin


class LidarLocalization(Localization):
    """Pure odometry until the estimator runs."""

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot = robot
        self._belief = belief

    @property
    def pose(self) -> Pose:
        return self._belief.pose

    @property
    def quality(self) -> float:
        return self._belief.quality

    @property
    def enabled(self) -> bool:
        return self._belief.localizing

    def enable(self, on: bool) -> None:
        self._belief.localizing = on

    def set_pose(self, pose: Pose) -> None:
        if not (math.hypot(pose.x, pose.y) <= POSITION_MAX and math.isfinite(pose.yaw)):
            raise InvalidGoal(f"not a place on this map: {pose}")
        told = Pose(pose.x, pose.y, wrap_angle(pose.yaw))
        self._belief.be_told(told)
        self._robot.events.publish(PoseJumped(stamp=self._robot.clock.time(), pose=told))
