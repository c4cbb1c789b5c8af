"""The EP's words, units and signs. Its axes: x forward, y right, z down, so yaw is clockwise and pitch is nose up.

Everything else in roboglot is REP-103: y left, z up, rad, rad/s. Only this file and readings.py know both.
"""

from __future__ import annotations

import math

from roboglot.model.components.interaction.armor import HitKind, PlatePlace
from roboglot.model.components.interaction.light import LightEffect
from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.components.motion.gripper import GripperStatus
from roboglot.model.geometry import Pose, Twist
from roboglot.model.perception import Gesture

RPM = math.tau / 60.0  # rad/s


def twist_of(x: float, y: float, z: float) -> Twist:
    """Return the EP's m/s, m/s and degrees/s as a twist in base_link."""
    return Twist(x, -y, -math.radians(z))


def offset_of(x: float, y: float, z: float) -> Pose:
    """Return the EP's m, m and degrees as a pose in base_link; z may exceed a turn."""
    return Pose(x, -y, -math.radians(z))


def wheels_of(w1: float, w2: float, w3: float, w4: float, as_robots: bool) -> WheelSpeeds:
    """Return wheel speeds from rpm: front right, front left, rear right, rear left; robots swap the last two."""
    right, left = (w4, w3) if as_robots else (w3, w4)
    return WheelSpeeds(front_right=w1 * RPM, front_left=w2 * RPM, rear_right=right * RPM, rear_left=left * RPM)


def wheels_in_rpm(speeds: WheelSpeeds, as_robots: bool) -> tuple[int, int, int, int]:
    """Return wheel speeds in whole rpm, as clients parse them with int(); robots begin with the front left."""
    if as_robots:
        in_order = (speeds.front_left, speeds.front_right, speeds.rear_left, speeds.rear_right)
    else:
        in_order = (speeds.front_right, speeds.front_left, speeds.rear_right, speeds.rear_left)
    w1, w2, w3, w4 = (round(speed / RPM) for speed in in_order)
    return w1, w2, w3, w4


def without_yaw(speeds: WheelSpeeds) -> WheelSpeeds:
    """Return wheel speeds without the component that turns the body."""
    turn = (speeds.front_right + speeds.rear_right - speeds.front_left - speeds.rear_left) / 4
    return WheelSpeeds(
        front_left=speeds.front_left + turn,
        front_right=speeds.front_right - turn,
        rear_left=speeds.rear_left + turn,
        rear_right=speeds.rear_right - turn,
    )


ARMOR = {
    PlatePlace.REAR: 1,
    PlatePlace.FRONT: 2,
    PlatePlace.LEFT: 3,
    PlatePlace.RIGHT: 4,
    PlatePlace.GIMBAL_LEFT: 5,
    PlatePlace.GIMBAL_RIGHT: 6,
}
HITS = {HitKind.BEAD: 0, HitKind.COLLISION: 1, HitKind.HAND: 2}
GRIPPER = {GripperStatus.CLOSED: 0, GripperStatus.BETWEEN: 1, GripperStatus.OPEN: 2}
GRIPPER_OF_ROBOTS = {GripperStatus.BETWEEN: 0, GripperStatus.OPEN: 1, GripperStatus.CLOSED: 2}
GESTURES = {Gesture.V: 4, Gesture.V_DOWN: 5, Gesture.PHOTO: 6}
MARKERS = (
    {"stop": 1, "left": 4, "right": 5, "forward": 6, "backward": 7, "heart": 8}
    | {str(digit): 10 + digit for digit in range(10)}
    | {chr(65 + letter): 20 + letter for letter in range(26)}
)
ZONES = {  # led_comp_enum: the light's zones
    "all": ("gimbal_left", "gimbal_right", "front", "rear", "left", "right"),
    "top_all": ("gimbal_left", "gimbal_right"),
    "top_left": ("gimbal_left",),
    "top_right": ("gimbal_right",),
    "bottom_all": ("front", "rear", "left", "right"),
    "bottom_front": ("front",),
    "bottom_back": ("rear",),
    "bottom_left": ("left",),
    "bottom_right": ("right",),
}
EFFECTS = {
    "solid": LightEffect.SOLID,
    "off": LightEffect.OFF,
    "pulse": LightEffect.BREATH,
    "blink": LightEffect.FLASH,
    "scrolling": LightEffect.SCROLLING,
}
EXPOSURES = {"default": 0.0, "small": -1.0, "medium": 0.5, "large": 1.5}  # stops; the manual gives no numbers
