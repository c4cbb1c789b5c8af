"""Dead reckoning: way from the wheels (wrong scale, noise, slip), heading from the gyro. Never jumps, always drifts."""

from __future__ import annotations

import math

import numpy as np

from roboglot.model.components.odometry import Odometry
from roboglot.model.geometry import STILL, Pose, Twist, wrap_angle
from roboglot.model.sensing import OdometryReading
from roboglot.simulation.body import Odometry as OdometrySection
from roboglot.simulation.components.base import SimulatedBase
from roboglot.simulation.components.imu import SimulatedImu


class SimulatedOdometry(Odometry):
    """Starts at (0, 0, 0) in odom, wherever the robot stands."""

    def __init__(
        self, section: OdometrySection, base: SimulatedBase, imu: SimulatedImu, random: np.random.Generator
    ) -> None:
        self._section, self._base, self._imu, self._random = section, base, imu, random
        self._scale_x, self._scale_y = (1.0 + random.normal(0.0, section.scale_error, 2)).tolist()
        self._reading = OdometryReading(0.0, Pose(), STILL, 0.0)

    @property
    def reading(self) -> OdometryReading:
        return self._reading

    def sense(self, stamp: float, seconds: float) -> None:
        """Add one tick's way."""
        wheels, old = self._base.velocity, self._reading
        still = not (wheels.x or wheels.y or wheels.yaw)
        # With still wheels a slow rate is the gyro's own error.
        rate = 0.0 if still and abs(self._imu.rate) < self._section.still_rate else self._imu.rate
        vx = vy = 0.0
        if wheels.x or wheels.y:
            nx, ny = self._random.standard_normal(2).tolist()
            vx = wheels.x * (self._scale_x + self._section.noise * nx)
            vy = wheels.y * (self._scale_y + self._section.noise * ny)
        middle = old.pose.yaw + rate * seconds / 2
        c, s = math.cos(middle), math.sin(middle)
        pose = Pose(
            old.pose.x + (c * vx - s * vy) * seconds,
            old.pose.y + (s * vx + c * vy) * seconds,
            wrap_angle(old.pose.yaw + rate * seconds),
        )
        way = old.distance + math.hypot(vx, vy) * seconds
        self._reading = OdometryReading(stamp, pose, Twist(vx, vy, rate), way)
