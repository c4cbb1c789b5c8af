"""What a robot tells of itself in one word, as components over the newest that its driver's watch has."""

from __future__ import annotations

from typing import Protocol

from roboglot.model.components.battery import Battery, DockContact
from roboglot.model.components.lidar import Lidar
from roboglot.model.sensing import BatteryState, LaserScan


class Newest(Protocol):
    """The newest of each, in the model's units; every driver keeps its own."""

    @property
    def scan(self) -> LaserScan | None: ...
    @property
    def battery(self) -> BatteryState: ...
    @property
    def docked(self) -> bool: ...


class ToldLidar(Lidar):
    """Scans as the robot sends them, or as it is asked for them: five a second."""

    rate = 5.0

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def scan(self) -> LaserScan | None:
        return self._newest.scan


class ToldBattery(Battery):
    """What a protocol does not tell of a battery is 0."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def state(self) -> BatteryState:
        return self._newest.battery


class ToldDockContact(DockContact):
    """Whether it says that it charges on its dock."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def docked(self) -> bool:
        return self._newest.docked
