"""What the dog tells of itself, as components over the newest."""

from __future__ import annotations

from roboglot.drivers.cyberdog.newest import Newest
from roboglot.model.clock import Clock
from roboglot.model.components.battery import Battery, DockContact
from roboglot.model.components.lidar import Lidar
from roboglot.model.components.odometry import Odometry
from roboglot.model.sensing import BatteryState, LaserScan, OdometryReading


class CyberDogOdometry(Odometry):
    """Reckoned; see ``Newest``."""

    def __init__(self, clock: Clock, newest: Newest) -> None:
        self._clock, self._newest = clock, newest

    @property
    def reading(self) -> OdometryReading:
        return self._newest.reckon(self._clock.time())


class CyberDogLidar(Lidar):
    """Push 6011."""

    rate = 5.0

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def scan(self) -> LaserScan | None:
        return self._newest.scan


class CyberDogBattery(Battery):
    """The heartbeat's."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def state(self) -> BatteryState:
        return self._newest.battery


class CyberDogDockContact(DockContact):
    """Wireless charging, by the heartbeat."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def docked(self) -> bool:
        return self._newest.docked
