"""Messages that panels publish: velocities, goals and poses in ROS's messages, as JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import msgspec

from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.operations import Right
from roboglot.protocols import ros_commands
from roboglot.protocols.foxglove.context import Context, Published
from roboglot.protocols.foxglove.table import TABLE
from roboglot.protocols.foxglove.vocabulary import PoseStamped, PoseWithCovarianceStamped, RosTwist, pose, twist
from roboglot.validation import decode_json, why_invalid

PUBLISHED_MAX = 100
MESSAGE_MAX = 65536  # bytes


@TABLE.on("advertise", right=Right.DRIVE)
async def advertise(context: Context, *, channels: list[Published]) -> None:
    """Register topics to publish: ``cmd_vel``, ``goal_pose``, ``move_base_simple/goal``, ``initialpose``, as JSON."""
    for channel in channels:
        if channel.encoding != "json":
            raise InvalidGoal(f"{channel.topic[:80]} comes as {channel.encoding[:20]}; JSON is understood")
        if _name(context, channel.topic) not in TOPICS:
            raise NotFound(f"the robot listens to {', '.join(TOPICS)}, not to {channel.topic[:80]}")
        if channel.id in context.published or len(context.published) >= PUBLISHED_MAX:
            raise InvalidGoal(f"channel {channel.id} is published already, or there are more than {PUBLISHED_MAX}")
        context.published[channel.id] = channel


@TABLE.on("unadvertise", right=Right.DRIVE)
async def unadvertise(context: Context, *, channel_ids: list[int]) -> None:
    """Unregister published topics."""
    missing = [number for number in channel_ids if context.published.pop(number, None) is None]
    if missing:
        raise NotFound(f"there is no published channel {missing[0]}")


@TABLE.on("messageData", right=Right.DRIVE)
async def publish(context: Context, *, channel: int, data: bytes) -> None:
    """Execute a published message."""
    published = context.published.get(channel)
    if published is None:
        raise NotFound(f"channel {channel} is not advertised")
    if len(data) > MESSAGE_MAX:
        raise InvalidGoal(f"a message has at most {MESSAGE_MAX} bytes")
    try:
        TOPICS[_name(context, published.topic)](context, data)
    except msgspec.DecodeError as error:  # includes ValidationError
        raise InvalidGoal(f"{published.topic}: {why_invalid(error)}") from None


def _name(context: Context, topic: str) -> str:
    """Return the topic without the robot's name."""
    return topic.removeprefix("/").removeprefix(f"{context.robot.id}/")


def _drive(context: Context, data: bytes) -> None:
    """Drive (geometry_msgs/Twist) until the next velocity, or for the dead-man time."""
    request = twist(decode_json(data, RosTwist))
    ros_commands.drive(context.robot, request, context.config.dead_man, context.source)


def _go(context: Context, data: bytes) -> None:
    """Navigate to a goal (geometry_msgs/PoseStamped); a status reports a failure."""
    goal = decode_json(data, PoseStamped)
    context.follow(ros_commands.go(context.robot, goal.header.frame_id, pose(goal.pose), context.source))


def _place(context: Context, data: bytes) -> None:
    """Set the robot's pose (geometry_msgs/PoseWithCovarianceStamped)."""
    there = decode_json(data, PoseWithCovarianceStamped)
    ros_commands.place(context.robot, there.header.frame_id, pose(there.pose.pose))


TOPICS: Mapping[str, Callable[[Context, bytes], None]] = {
    "cmd_vel": _drive,
    "goal_pose": _go,
    "move_base_simple/goal": _go,
    "initialpose": _place,
}
