"""What a robot tells of itself in one word, as components: each asks its driver for the newest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Unconnected
from roboglot.model.maps import OccupancyGrid
from roboglot.model.sensing import BatteryState, ImuReading, LaserScan, OdometryReading


class ReportedLidar(Lidar):
    """Scans as the robot sends them, or as it is asked for them: five a second."""

    rate = 5.0

    def __init__(self, reported: Callable[[], LaserScan | None]) -> None:
        self._reported = reported

    @property
    def scan(self) -> LaserScan | None:
        return self._reported()


class ReportedOdometry(Odometry):
    """Told, or reckoned by the driver."""

    def __init__(self, reported: Callable[[], OdometryReading]) -> None:
        self._reported = reported

    @property
    def reading(self) -> OdometryReading:
        return self._reported()


class ReportedImu(Imu):
    """Raises Unconnected before the robot has told its attitude."""

    def __init__(self, reported: Callable[[], ImuReading | None]) -> None:
        self._reported = reported

    @property
    def reading(self) -> ImuReading:
        if (told := self._reported()) is None:
            raise Unconnected("the robot has not told its attitude yet")
        return told


class ReportedMap(Protocol):
    """What a driver knows of the robot's map."""

    @property
    def grid(self) -> OccupancyGrid: ...
    @property
    def revision(self) -> int: ...


class ReportedMapping(Mapping):
    """The map as the robot told it last; what can be done to it is the driver's affair."""

    def __init__(self, reported: ReportedMap) -> None:
        self._told = reported

    @property
    def grid(self) -> OccupancyGrid:
        return self._told.grid

    @property
    def revision(self) -> int:
        return self._told.revision


class ReportedBattery(Battery):
    """What a protocol does not tell of a battery is 0."""

    def __init__(self, reported: Callable[[], BatteryState]) -> None:
        self._reported = reported

    @property
    def state(self) -> BatteryState:
        return self._reported()


class ReportedDockContact(DockContact):
    """Whether it says that it charges on its dock."""

    def __init__(self, reported: Callable[[], bool]) -> None:
        self._reported = reported

    @property
    def docked(self) -> bool:
        return self._reported()
