"""Readings of chassis and gimbal, in the EP's units, signs and order (manual 3.2.3.4 to 3.2.4.9)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import astuple
from typing import Protocol

from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.motion_status import MotionStatus
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.link import require_current, require_heard
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.model.robot import Robot
from roboglot.protocols.robomaster.vocabulary import wheels_in_rpm
from roboglot.wire.robomaster.replies import Number, Profile


class ReadingSource(Protocol):
    """The robot to be read, and the profile of its answers."""

    @property
    def robot(self) -> Robot:
        """Robot that is read."""

    @property
    def origin(self) -> Pose:
        """Origin of chassis positions, in the odometry's frame."""

    @property
    def profile(self) -> Profile:
        """Profile of the answers, where robots differ from the manual."""


def position(source: ReadingSource) -> tuple[float, float, float]:
    """x m, y m, z degrees since power-on (robots: since ``command``), by odometry (so it drifts); z in (-180, 180]."""
    require_heard(source.robot)
    pose = source.robot[Odometry].reading.pose
    if source.origin is not ORIGIN:
        pose = pose.relative_to(source.origin)
    return pose.x, -pose.y, -math.degrees(pose.yaw)


def attitude(robot: Robot) -> tuple[float, float, float]:
    """pitch, roll, yaw in degrees by the IMU, yaw since power-on."""
    require_heard(robot)
    orientation = robot[Imu].reading.orientation
    return -math.degrees(orientation.pitch), math.degrees(orientation.roll), -math.degrees(orientation.yaw)


def speed(source: ReadingSource) -> tuple[float | int, ...]:
    """x m/s, y m/s, z degrees/s as odometry measures them, and the four wheels in whole rpm."""
    robot = source.robot
    require_current(robot)
    twist = robot[Odometry].reading.twist
    wheels = wheels_in_rpm(robot[Base].wheel_speeds, source.profile.as_robots)
    return (twist.x, -twist.y, -math.degrees(twist.yaw), *wheels)


def status(robot: Robot) -> tuple[int, ...]:
    """Eleven flags: static, uphill, downhill, on_slope, pick_up, slip, impact_x, _y, _z, roll_over, hill_static."""
    require_current(robot)
    return tuple(int(flag) for flag in astuple(robot[MotionStatus].flags))


def gimbal_attitude(robot: Robot) -> tuple[float, float]:
    """pitch to the horizon (up is positive) and yaw to the chassis (right is positive, past half a turn) in degrees."""
    require_heard(robot)
    gimbal = robot[Gimbal]
    return -math.degrees(gimbal.attitude.pitch), -math.degrees(gimbal.angles.yaw)


# Values that can be pushed, by module, in the manual's order. The position push carries no angle.
PUSHED: dict[str, dict[str, Callable[[ReadingSource], tuple[Number, ...]]]] = {
    "chassis": {
        "position": lambda source: position(source)[:2],
        "attitude": lambda source: attitude(source.robot),
        "status": lambda source: status(source.robot),
    },
    "gimbal": {"attitude": lambda source: gimbal_attitude(source.robot)},
}
