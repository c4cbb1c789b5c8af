"""Topics that the robot subscribes to: velocities, goals and poses."""

from __future__ import annotations

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.operations import Right
from roboglot.protocols.ros2.context import Context
from roboglot.protocols.ros2.table import TABLE
from roboglot.protocols.ros2.vocabulary import PoseStamped, PoseWithCovarianceStamped, TwistMessage, pose, twist
from roboglot.protocols.ros_commands import drive, go, place


@TABLE.on("cmd_vel", right=Right.DRIVE, needs=(Base, Driving))
async def take_velocity(context: Context, *, message: TwistMessage) -> None:
    """geometry_msgs/Twist: drive so until the next one, or for as long as the dead-man's time."""
    drive(context.robot, twist(message), context.config.dead_man, context.source)


@TABLE.on("goal_pose", right=Right.DRIVE, needs=(Localization, Navigation, Odometry))
async def take_goal(context: Context, *, message: PoseStamped) -> None:
    """geometry_msgs/PoseStamped: go there; a line of ``/rosout`` reports if that fails."""
    frame = message.header.frame_id
    context.follow(go(context.robot, frame, pose(message.pose), context.source))


@TABLE.on("initialpose", right=Right.DRIVE, needs=(Localization, Odometry))
async def take_pose(context: Context, *, message: PoseWithCovarianceStamped) -> None:
    """geometry_msgs/PoseWithCovarianceStamped: the robot is there."""
    place(context.robot, message.header.frame_id, pose(message.pose.pose))
