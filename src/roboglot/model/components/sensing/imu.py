"""The inertial measurement unit."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.sensing import ImuReading, RawImu


class Imu(Component):
    """Gyro and accelerometer with their noise; yaw is integrated and drifts."""

    averages = False  # whether an acceleration is the mean since the last reading, and can be integrated

    @property
    @abstractmethod
    def reading(self) -> ImuReading:
        """Latest reading."""


class ImuConverters(Component):
    """Output of the converters behind accelerometer, gyro and compass; real robots do not report it by a driver."""

    @property
    @abstractmethod
    def raw(self) -> RawImu:
        """Latest raw reading, before any conversion."""
