"""Dead reckoning from the wheels and the gyro."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.sensing import OdometryReading


class Odometry(Component):
    """Smooth and drifting."""

    @property
    @abstractmethod
    def reading(self) -> OdometryReading:
        """The newest: pose in odom, measured twist in base_link, metres travelled."""
