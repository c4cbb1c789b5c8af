"""The EP's words, units and signs. Its axes: x forward, y right, z down, so yaw is clockwise and pitch is nose up.

Everything else in roboglot is REP-103: y left, z up, rad, rad/s. Only this file and readings.py know both.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Annotated, Literal

from msgspec import Meta

from roboglot.model.components.base import WheelSpeeds
from roboglot.model.geometry import Pose, Twist

SpeedXY = Annotated[float, Meta(ge=-3.5, le=3.5)]  # m/s
SpeedZ = Annotated[float, Meta(ge=-600, le=600)]  # degrees/s
DistanceXY = Annotated[float, Meta(ge=-5, le=5)]  # m
AngleZ = Annotated[float, Meta(ge=-1800, le=1800)]  # degrees; the text says int, clients send 30.000000
TopSpeedXY = Annotated[float, Meta(gt=0, le=3.5)]  # m/s
TopSpeedZ = Annotated[float, Meta(gt=0, le=600)]  # degrees/s
WheelSpeed = Annotated[float, Meta(ge=-1000, le=1000)]  # rpm; the text says int, clients send floats
Rate = Literal[1, 5, 10, 20, 30, 50]  # Hz
Switch = Literal["on", "off", ""]  # "": the attribute was named without a switch

RPM = math.tau / 60.0  # rad/s


class Mode(StrEnum):
    """mode_enum: who follows whom in yaw."""

    CHASSIS_LEAD = "chassis_lead"
    GIMBAL_LEAD = "gimbal_lead"
    FREE = "free"


def twist_of(x: float, y: float, z: float) -> Twist:
    """The EP's m/s, m/s and degrees/s as a twist in base_link."""
    return Twist(x, -y, -math.radians(z))


def offset_of(x: float, y: float, z: float) -> Pose:
    """The EP's m, m and degrees as a pose in base_link; z may exceed a turn."""
    return Pose(x, -y, -math.radians(z))


def wheels_of(w1: float, w2: float, w3: float, w4: float) -> WheelSpeeds:
    """The text's wheels in rpm: w1 front right, w2 front left, w3 rear right, w4 rear left."""
    return WheelSpeeds(front_right=w1 * RPM, front_left=w2 * RPM, rear_right=w3 * RPM, rear_left=w4 * RPM)


def wheels_in_rpm(speeds: WheelSpeeds) -> tuple[int, int, int, int]:
    """The other way round; whole numbers, because clients read them with int()."""
    in_order = (speeds.front_right, speeds.front_left, speeds.rear_right, speeds.rear_left)
    w1, w2, w3, w4 = (round(speed / RPM) for speed in in_order)
    return w1, w2, w3, w4
