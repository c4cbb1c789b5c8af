"""What the robot tells of itself, as components. They hold nothing but the newest that the watch read."""

from __future__ import annotations

from roboglot.drivers.slamware.newest import Newest
from roboglot.model.components.battery import Battery, DockContact
from roboglot.model.components.imu import Imu
from roboglot.model.components.lidar import Lidar
from roboglot.model.components.odometry import Odometry
from roboglot.model.errors import Unconnected
from roboglot.model.sensing import BatteryState, ImuReading, LaserScan, OdometryReading


class SlamwareOdometry(Odometry):
    """``odopose`` and ``speed``; the distance is summed up here, from the connection on."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def reading(self) -> OdometryReading:
        return self._newest.odometry


class SlamwareLidar(Lidar):
    """``laserscan``, asked for five times a second."""

    rate = 5.0

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def scan(self) -> LaserScan | None:
        return self._newest.scan


class SlamwareImu(Imu):
    """``imu``."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def reading(self) -> ImuReading:
        if self._newest.imu is None:
            raise Unconnected("the robot has not told its attitude yet")
        return self._newest.imu


class SlamwareBattery(Battery):
    """``power/status``, and ``battery/pack`` where there is one. The API tells neither voltage nor cycles (0)."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def state(self) -> BatteryState:
        return self._newest.battery


class SlamwareDockContact(DockContact):
    """``power/status``."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def docked(self) -> bool:
        return self._newest.docked
