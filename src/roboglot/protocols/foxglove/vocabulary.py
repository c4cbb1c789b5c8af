"""Vocabulary of the protocol: ROS messages as JSON that clients publish, and parameters by name."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any

import msgspec

from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping as Mapper
from roboglot.model.components.motion.base import Base
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.ros_commands import heading
from roboglot.validation import decode_json
from roboglot.values import dataclass
from roboglot.wire.foxglove.messages import PUBLISHED_SIZE, ClientOpcode

DOOR = "foxglove"


class Vector(msgspec.Struct):
    """geometry_msgs/Vector3 and Point."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Quaternion(msgspec.Struct):
    """geometry_msgs/Quaternion."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0

    @property
    def yaw(self) -> float:
        """The heading, rad. Raises InvalidGoal for what turns nothing."""
        return heading(self.x, self.y, self.z, self.w)


class RosPose(msgspec.Struct):
    """geometry_msgs/Pose."""

    position: Vector = msgspec.field(default_factory=Vector)
    orientation: Quaternion = msgspec.field(default_factory=Quaternion)


class Header(msgspec.Struct):
    """std_msgs/Header."""

    frame_id: str = ""


class PoseStamped(msgspec.Struct):
    """geometry_msgs/PoseStamped."""

    pose: RosPose
    header: Header = msgspec.field(default_factory=Header)


class WithCovariance(msgspec.Struct):
    """geometry_msgs/PoseWithCovariance; the covariance is not used."""

    pose: RosPose


class PoseWithCovarianceStamped(msgspec.Struct):
    """geometry_msgs/PoseWithCovarianceStamped."""

    pose: WithCovariance
    header: Header = msgspec.field(default_factory=Header)


class RosTwist(msgspec.Struct):
    """geometry_msgs/Twist."""

    linear: Vector
    angular: Vector


def twist(message: RosTwist) -> Twist:
    """Return the velocity."""
    return Twist(message.linear.x, message.linear.y, message.angular.z)


def stops(message: str | bytes) -> bool:
    """Return whether a message is a published velocity of zero."""
    if isinstance(message, str) or not message or message[0] != ClientOpcode.MESSAGE_DATA:
        return False
    try:
        request = decode_json(message[PUBLISHED_SIZE:], RosTwist)
    except msgspec.DecodeError:
        return False
    return twist(request) == Twist()


def pose(message: RosPose) -> Pose:
    """Return the pose, in the frame of the message. Raises InvalidGoal."""
    return Pose(message.position.x, message.position.y, message.orientation.yaw)


@dataclass(frozen=True, slots=True)
class Parameter:
    """A value of the robot; ``write`` and ``right`` where clients may set it."""

    read: Callable[[Robot], object]
    needs: type | None = None
    kind: type = str
    write: Callable[[Robot, Any], Awaitable[None] | None] | None = None
    right: Right = Right.EDIT


PARAMETERS: Mapping[str, Parameter] = {
    "robot.name": Parameter(lambda robot: robot.id),
    "robot.maker": Parameter(lambda robot: robot.description.maker),
    "robot.model": Parameter(lambda robot: robot.description.model),
    "robot.serial": Parameter(lambda robot: robot.description.serial),
    "robot.radius": Parameter(lambda robot: robot.description.radius, kind=float),
    "robot.height": Parameter(lambda robot: robot.description.height, kind=float),
    "base.max_speed": Parameter(lambda robot: robot[Base].limits.twist.x, Base, float),
    "base.max_yaw_speed": Parameter(lambda robot: robot[Base].limits.twist.yaw, Base, float),
    "localization.enabled": Parameter(
        lambda robot: robot[Localization].enabled,
        Localization,
        bool,
        lambda robot, value: robot[Localization].enable(value),
    ),
    "mapping.enabled": Parameter(
        lambda robot: robot[Mapper].enabled, Mapper, bool, lambda robot, value: robot[Mapper].enable(value)
    ),
    "mapping.closes_loops": Parameter(
        lambda robot: robot[Mapper].closes_loops, Mapper, bool, lambda robot, value: robot[Mapper].close_loops(value)
    ),
    "speaker.volume": Parameter(
        lambda robot: robot[Speaker].volume,
        Speaker,
        float,
        lambda robot, value: robot[Speaker].set_volume(value),
        Right.DRIVE,
    ),
}


def parameters(robot: Robot, names: list[str] | None = None) -> list[dict[str, Any]]:
    """Return the named parameters (None or none: all) that this robot has."""
    found = []
    for name in names or PARAMETERS:
        parameter = PARAMETERS.get(name)
        if parameter is not None and (parameter.needs is None or parameter.needs in robot):
            value: dict[str, object] = {"name": name, "value": parameter.read(robot)}
            found.append(value | ({"type": "float64"} if parameter.kind is float else {}))
    return found
