"""Components that only read: each returns the latest value that its driver received from the robot."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry, OdometryNoise
from roboglot.model.errors import Unconnected
from roboglot.model.maps import OccupancyGrid
from roboglot.model.sensing import BatteryState, ImuReading, LaserScan, OdometryReading

DESCRIBED = Path(__file__).parent / "odometry.toml"


class ReportedLidar(Lidar):
    """Scans pushed by the robot or polled by the driver, five a second."""

    rate = 5.0

    def __init__(self, reported: Callable[[], LaserScan | None]) -> None:
        self._reported = reported

    @property
    def scan(self) -> LaserScan | None:
        return self._reported()


class ReportedOdometry(Odometry):
    """Odometry as reported by the robot or dead-reckoned by the driver; ``kind``: its section of odometry.toml."""

    def __init__(self, reported: Callable[[], OdometryReading], kind: str) -> None:
        self._reported = reported
        self._noise = OdometryNoise(**tomllib.loads(DESCRIBED.read_text("utf-8"))[kind])

    @property
    def noise(self) -> OdometryNoise:
        return self._noise

    @property
    def reading(self) -> OdometryReading:
        return self._reported()


class ReportedImu(Imu):
    """Attitude as reported. Raises Unconnected until the first report."""

    def __init__(self, reported: Callable[[], ImuReading | None]) -> None:
        self._reported = reported

    @property
    def reading(self) -> ImuReading:
        if (reading := self._reported()) is None:
            raise Unconnected("the robot has not reported its attitude yet")
        return reading


class ReportedMap(Protocol):
    """The robot's map as its driver knows it."""

    @property
    def grid(self) -> OccupancyGrid: ...
    @property
    def revision(self) -> int: ...


class ReportedMapping(Mapping):
    """The latest map of the robot; drivers add the operations of their protocol."""

    def __init__(self, reported: ReportedMap) -> None:
        self._reported_map = reported

    @property
    def grid(self) -> OccupancyGrid:
        return self._reported_map.grid

    @property
    def revision(self) -> int:
        return self._reported_map.revision


class ReportedBattery(Battery):
    """Battery as reported; fields that the protocol lacks are 0."""

    def __init__(self, reported: Callable[[], BatteryState]) -> None:
        self._reported = reported

    @property
    def state(self) -> BatteryState:
        return self._reported()


class ReportedDockContact(DockContact):
    """Dock contact as reported: true while the robot reports charging on its dock."""

    def __init__(self, reported: Callable[[], bool]) -> None:
        self._reported = reported

    @property
    def docked(self) -> bool:
        return self._reported()
