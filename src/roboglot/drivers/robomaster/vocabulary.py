"""Converts units and signs between the EP (x forward, y right, yaw clockwise, pitch up; degrees, rpm) and the model."""

from __future__ import annotations

import math
from contextlib import AbstractContextManager

from roboglot.clients.errors import BadAnswer, ClientError, RefusedByRobot
from roboglot.clients.robomaster.chapters.chassis import ChassisPose, ChassisSpeed
from roboglot.drivers.errors import model_errors
from roboglot.model.components.interaction.armor import HitKind, PlatePlace
from roboglot.model.components.interaction.light import LightEffect
from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.components.motion.gimbal import GimbalAngles
from roboglot.model.components.motion.gripper import GripperStatus
from roboglot.model.components.motion.motion_status import MotionFlags
from roboglot.model.errors import Refused, RobotError
from roboglot.model.geometry import Orientation, Pose, Twist, wrap_angle
from roboglot.wire.robomaster.telemetry import ChassisAttitude, ChassisStatus, GimbalAttitude

RPM = math.tau / 60  # rad/s
PLATES = {
    1: PlatePlace.REAR,
    2: PlatePlace.FRONT,
    3: PlatePlace.LEFT,
    4: PlatePlace.RIGHT,
    5: PlatePlace.GIMBAL_LEFT,
    6: PlatePlace.GIMBAL_RIGHT,
}
HITS = {0: HitKind.BEAD, 1: HitKind.COLLISION, 2: HitKind.HAND}
GRIPPER = (GripperStatus.CLOSED, GripperStatus.BETWEEN, GripperStatus.OPEN)
GRIPPER_OF_ROBOTS = (GripperStatus.BETWEEN, GripperStatus.OPEN, GripperStatus.CLOSED)
LAMPS = {
    "front": "bottom_front",
    "rear": "bottom_back",
    "left": "bottom_left",
    "right": "bottom_right",
    "gimbal_left": "top_left",
    "gimbal_right": "top_right",
}
EFFECTS = {
    LightEffect.SOLID: "solid",
    LightEffect.OFF: "off",
    LightEffect.BREATH: "pulse",
    LightEffect.FLASH: "blink",
    LightEffect.SCROLLING: "scrolling",
}
EXPOSURES = {"default": 0.0, "small": -1.0, "medium": 0.5, "large": 1.5}  # stops; the manual gives no numbers


def robot_errors() -> AbstractContextManager[None]:
    """Raise the client's errors as the model's."""
    return model_errors(_translated)


def _translated(error: ClientError) -> RobotError | None:
    match error:
        case RefusedByRobot():
            return Refused(f"the robot answered {error.code} to {error.operation}")
    return None


def speed_words(twist: Twist) -> tuple[float, float, float]:
    """Return x, y in m/s and z in degrees/s, as ``chassis speed`` takes them."""
    return round(twist.x, 4), round(-twist.y, 4), round(-math.degrees(twist.yaw), 3)


def wheel_words(speeds: WheelSpeeds, as_robots: bool) -> tuple[int, int, int, int]:
    """Return rpm as ``chassis wheel`` takes them: front right and left, rear right and left; robots swap the rear."""
    rear = (speeds.rear_left, speeds.rear_right) if as_robots else (speeds.rear_right, speeds.rear_left)
    in_order = (speeds.front_right, speeds.front_left, *rear)
    w1, w2, w3, w4 = (round(speed / RPM) for speed in in_order)
    return w1, w2, w3, w4


def twist_of(speed: ChassisSpeed) -> Twist:
    """Return the measured velocity."""
    return Twist(speed.x, -speed.y, -math.radians(speed.z))


def wheels_of(speed: ChassisSpeed, as_robots: bool) -> WheelSpeeds:
    """Return the measured wheel speeds: in the order of ``chassis wheel``, on real robots with the left ones first."""
    w1, w2, w3, w4 = (word * RPM for word in (speed.w1, speed.w2, speed.w3, speed.w4))
    if as_robots:
        return WheelSpeeds(front_left=w1, front_right=w2, rear_left=w3, rear_right=w4)
    return WheelSpeeds(front_right=w1, front_left=w2, rear_right=w3, rear_left=w4)


def gripper_status(number: int, as_robots: bool) -> GripperStatus:
    """Return the status. Raises BadAnswer for an unknown number."""
    try:
        return (GRIPPER_OF_ROBOTS if as_robots else GRIPPER)[number]
    except IndexError:
        raise BadAnswer(f"a gripper's status is 0, 1 or 2, not {number}") from None


def pose_of(pose: ChassisPose) -> Pose:
    """Return the odometry pose since power-on, or since the connection."""
    return Pose(pose.x, -pose.y, wrap_angle(-math.radians(pose.z)))


def orientation_of(attitude: ChassisAttitude) -> Orientation:
    """Return the attitude; pitch up is negative in the model."""
    return Orientation(
        math.radians(attitude.roll), -math.radians(attitude.pitch), wrap_angle(-math.radians(attitude.yaw))
    )


def flags_of(status: ChassisStatus) -> MotionFlags:
    """Return the motion flags."""
    return MotionFlags(
        static=status.static,
        uphill=status.uphill,
        downhill=status.downhill,
        sliding=status.on_slope,
        picked_up=status.pick_up,
        slipping=status.slip,
        impact_x=status.impact_x,
        impact_y=status.impact_y,
        impact_z=status.impact_z,
        rolled_over=status.roll_over,
        static_on_slope=status.hill_static,
    )


def angles_of(attitude: GimbalAttitude) -> GimbalAngles:
    """Return pitch against the horizon and yaw against the chassis."""
    return GimbalAngles(-math.radians(attitude.pitch), -math.radians(attitude.yaw))
