"""The inertial measurement unit."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.errors import Refused
from roboglot.model.sensing import ImuReading, RawImu


class Imu(Component):
    """Gyro and accelerometer with their noise; yaw is integrated and drifts."""

    averages = False  # whether an acceleration is the mean since the last reading, and can be integrated

    @property
    @abstractmethod
    def reading(self) -> ImuReading:
        """Latest reading."""

    @property
    def raw(self) -> RawImu:
        """Return the latest raw reading, before any conversion. Raises Refused where the robot does not report it."""
        raise Refused("this robot's IMU does not report raw values")
