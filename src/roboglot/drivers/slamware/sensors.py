"""What the robot tells of itself, as components. They hold nothing but the newest that the watch read."""

from __future__ import annotations

from roboglot.drivers.slamware.newest import Newest
from roboglot.model.components.imu import Imu
from roboglot.model.components.odometry import Odometry
from roboglot.model.errors import Unconnected
from roboglot.model.sensing import ImuReading, OdometryReading


class SlamwareOdometry(Odometry):
    """``odopose`` and ``speed``; the distance is summed up here, from the connection on."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def reading(self) -> OdometryReading:
        return self._newest.odometry


class SlamwareImu(Imu):
    """``imu``."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def reading(self) -> ImuReading:
        if self._newest.imu is None:
            raise Unconnected("the robot has not told its attitude yet")
        return self._newest.imu
