"""Dead reckoning from the wheels and the gyro."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.sensing import OdometryReading
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class OdometryNoise:
    """Standard deviations of odometry between two scans.

    ``still`` (m) and ``yaw_still`` (rad) always; ``along`` (m per m driven), ``turning`` (m per rad turned: a base that
    is off its centre), ``yaw_per_rad`` (rad per rad turned), ``yaw_per_metre`` (rad per m driven).
    """

    still: float = 0.001
    along: float = 0.1
    turning: float = 0.0
    yaw_still: float = 0.0005
    yaw_per_rad: float = 0.05
    yaw_per_metre: float = 0.02

    def variances(self, way: float, turn: float) -> tuple[float, float]:
        """Return the variances of position (m2, in each direction) and yaw (rad2) after ``way`` m and ``turn`` rad."""
        return (
            (self.still + self.along * way + self.turning * turn) ** 2,
            (self.yaw_still + self.yaw_per_rad * turn + self.yaw_per_metre * way) ** 2,
        )


class Odometry(Component):
    """Dead reckoning: smooth, but drifting."""

    @property
    @abstractmethod
    def reading(self) -> OdometryReading:
        """Latest reading: pose in odom, measured twist in base_link, metres travelled."""

    @property
    def noise(self) -> OdometryNoise:
        """Expected error of the odometry, from the body or the driver."""
        return OdometryNoise()
