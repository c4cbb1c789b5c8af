"""Types of subscribed messages, and poses and velocities read from them."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from roboglot.model.geometry import Pose, Twist
from roboglot.protocols.ros_commands import heading

DOOR = "ros2"
TYPES = {
    "cmd_vel": "geometry_msgs/msg/Twist",
    "goal_pose": "geometry_msgs/msg/PoseStamped",
    "initialpose": "geometry_msgs/msg/PoseWithCovarianceStamped",
}


class Vector(Protocol):
    """geometry_msgs/Point or Vector3."""

    x: float
    y: float
    z: float


class Quaternion(Vector, Protocol):
    """geometry_msgs/Quaternion."""

    w: float


class Header(Protocol):
    """std_msgs/Header."""

    frame_id: str


class PoseMessage(Protocol):
    """geometry_msgs/Pose."""

    position: Vector
    orientation: Quaternion


class PoseWithCovariance(Protocol):
    """geometry_msgs/PoseWithCovariance."""

    pose: PoseMessage


@runtime_checkable
class TwistMessage(Protocol):
    """geometry_msgs/Twist."""

    linear: Vector
    angular: Vector


@runtime_checkable
class PoseStamped(Protocol):
    """geometry_msgs/PoseStamped."""

    header: Header
    pose: PoseMessage


@runtime_checkable
class PoseWithCovarianceStamped(Protocol):
    """geometry_msgs/PoseWithCovarianceStamped."""

    header: Header
    pose: PoseWithCovariance


def twist(message: TwistMessage) -> Twist:
    """Return the velocity of a geometry_msgs/Twist."""
    return Twist(message.linear.x, message.linear.y, message.angular.z)


def pose(message: PoseMessage) -> Pose:
    """Return a geometry_msgs/Pose. Raises InvalidGoal."""
    turn = message.orientation
    return Pose(message.position.x, message.position.y, heading(turn.x, turn.y, turn.z, turn.w))
