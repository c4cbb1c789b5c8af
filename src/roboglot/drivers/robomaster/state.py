"""Latest values that an EP reported, in the model's units."""

from __future__ import annotations

from dataclasses import field

from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.components.motion.gimbal import GimbalAngles
from roboglot.model.components.motion.motion_status import MotionFlags
from roboglot.model.geometry import ORIGIN, STILL, Orientation, Twist, Vector3
from roboglot.model.sensing import BatteryState, ImuReading, OdometryReading
from roboglot.values import dataclass


@dataclass(slots=True)
class ReportedState:
    """Starts level at the origin with an empty battery until the first reports."""

    odometry: OdometryReading = field(default_factory=lambda: OdometryReading(0.0, ORIGIN, STILL, 0.0))
    twist: Twist = STILL
    wheels: WheelSpeeds = field(default_factory=WheelSpeeds)
    imu: ImuReading = field(default_factory=lambda: ImuReading(0.0, Orientation(), Vector3(), Vector3()))
    flags: MotionFlags = field(default_factory=MotionFlags)
    battery: BatteryState = field(default_factory=lambda: BatteryState(0.0, 0.0, 0.0, 0.0, False, 0))
    gimbal: GimbalAngles = field(default_factory=GimbalAngles)
    latency: float = 0.0  # s: round trip, smoothed
