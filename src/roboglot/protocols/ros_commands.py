"""Commands of ROS's usual topics (cmd_vel, goal_pose, initialpose), and levels of errors, for all doors with them."""

from __future__ import annotations

import logging
import math

from roboglot.model.actions import Action
from roboglot.model.clock import RealClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Busy, InvalidGoal, Refused, RobotError
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot

FAR = 1e6  # m, m/s: larger values are mistakes
LEVELS: dict[type[RobotError], int] = {
    Busy: logging.WARNING,
    Refused: logging.WARNING,
    RobotError: logging.ERROR,
}


def level_of(error: RobotError) -> int:
    """Return the level of ``error``, by its nearest ancestor in the table; rcl's levels are Python's."""
    return next(LEVELS[kind] for kind in type(error).__mro__ if kind in LEVELS)


def drive(robot: Robot, request: Twist, dead_man: float, source: str) -> None:
    """Drive at this velocity until the next command, for ``dead_man`` s of real time at most. Raises RobotError."""
    if not all(abs(value) < FAR for value in (request.x, request.y, request.yaw)):
        raise InvalidGoal("a velocity is not finite")
    limits = robot[Base].limits
    if not limits.holonomic:
        request = Twist(request.x, 0.0, request.yaw)
    pace = robot.clock.speed if isinstance(robot.clock, RealClock) else 1.0
    robot[Driving].drive(request.clamped(limits.twist), lifetime=dead_man * pace, source=source)


def go(robot: Robot, frame: str, pose: Pose, source: str) -> Action:
    """Navigate to a pose. Raises RobotError."""
    goal = pose_in_map(robot, frame, pose)
    return robot[Navigation].navigate_to([goal.point], NavigationOptions(yaw=goal.yaw), source=source)


def place(robot: Robot, frame: str, pose: Pose) -> None:
    """Set the robot's pose in its map. Raises RobotError."""
    robot[Localization].set_pose(pose_in_map(robot, frame, pose))


def heading(x: float, y: float, z: float, w: float) -> float:
    """Return the yaw of a quaternion of any length, rad. Raises InvalidGoal for one that turns nothing."""
    if not all(map(math.isfinite, (x, y, z, w))) or not any((x, y, z, w)):
        raise InvalidGoal("the orientation is not a quaternion")
    largest = max(map(abs, (x, y, z, w)))
    x, y, z, w = x / largest, y / largest, z / largest, w / largest
    return math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)


def pose_in_map(robot: Robot, frame: str, pose: Pose) -> Pose:
    """Return the pose in the robot's map; a frame may have the robot's name before it. Raises RobotError."""
    if not (abs(pose.x) < FAR and abs(pose.y) < FAR):
        raise InvalidGoal("the position is not finite")
    match frame.removeprefix("/").removeprefix(f"{robot.id}/"):
        case "" | "map":
            return pose
        case "base_link":
            return robot[Localization].pose.compose(pose)
        case "odom":
            here = robot[Localization].pose
            return here.compose(robot[Odometry].reading.pose.inverse()).compose(pose)
        case other:
            raise InvalidGoal(f"there is no frame {other[:80]!r}: the frames are map, odom and base_link")
