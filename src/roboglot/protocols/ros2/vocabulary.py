"""ROS's words for robots: types of what is listened to, poses and velocities out of its messages."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Pose, Twist

DOOR = "ros2"
Ros: TypeAlias = Any  # a message of rosbags, whose classes are made at run time
TYPES = {
    "cmd_vel": "geometry_msgs/msg/Twist",
    "goal_pose": "geometry_msgs/msg/PoseStamped",
    "initialpose": "geometry_msgs/msg/PoseWithCovarianceStamped",
}


def twist(message: Ros) -> Twist:
    """Return the velocity of a geometry_msgs/Twist."""
    return Twist(message.linear.x, message.linear.y, message.angular.z)


def pose(message: Ros) -> Pose:
    """Return a geometry_msgs/Pose. Raises InvalidGoal."""
    turn = message.orientation
    parts = turn.x, turn.y, turn.z, turn.w
    if not all(map(math.isfinite, parts)) or not any(parts):
        raise InvalidGoal("the orientation is no quaternion")
    yaw = math.atan2(2 * (turn.w * turn.z + turn.x * turn.y), 1 - 2 * (turn.y**2 + turn.z**2))
    return Pose(message.position.x, message.position.y, yaw)
