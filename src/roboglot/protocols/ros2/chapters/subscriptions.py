"""What the robot listens to: velocities, goals and poses."""

from __future__ import annotations

from typing import Any

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation
from roboglot.operations import Right
from roboglot.protocols import ros_commands
from roboglot.protocols.ros2.context import Context
from roboglot.protocols.ros2.table import TABLE
from roboglot.protocols.ros2.vocabulary import pose, twist


@TABLE.on("cmd_vel", right=Right.DRIVE, needs=(Driving,))
async def drive(context: Context, *, message: Any) -> None:
    """geometry_msgs/Twist: drive so until the next one, or for as long as the dead-man's time."""
    ros_commands.drive(context.robot, twist(message), context.config.dead_man, context.source)


@TABLE.on("goal_pose", right=Right.DRIVE, needs=(Navigation,))
async def go(context: Context, *, message: Any) -> None:
    """geometry_msgs/PoseStamped: go there; a line of ``/rosout`` reports if that fails."""
    frame = message.header.frame_id
    context.follow(ros_commands.go(context.robot, frame, pose(message.pose), context.source))


@TABLE.on("initialpose", right=Right.DRIVE, needs=(Localization,))
async def place(context: Context, *, message: Any) -> None:
    """geometry_msgs/PoseWithCovarianceStamped: the robot is there."""
    ros_commands.place(context.robot, message.header.frame_id, pose(message.pose.pose))
