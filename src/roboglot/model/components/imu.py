"""The inertial measurement unit."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.sensing import ImuReading


class Imu(Component):
    """Gyro and accelerometer with their noise; yaw is integrated and drifts."""

    @property
    @abstractmethod
    def reading(self) -> ImuReading:
        """The newest."""
