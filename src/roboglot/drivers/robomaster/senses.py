"""What the robot tells of itself, as components over the newest that the watch heard."""

from __future__ import annotations

from roboglot.drivers.robomaster.newest import Newest
from roboglot.model.components.battery import Battery
from roboglot.model.components.imu import Imu
from roboglot.model.components.motion_status import MotionFlags, MotionStatus
from roboglot.model.components.odometry import Odometry
from roboglot.model.sensing import BatteryState, ImuReading, OdometryReading


class RoboMasterOdometry(Odometry):
    """``chassis push position``, the heading by the attitude push, the twist by ``chassis speed ?``."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def reading(self) -> OdometryReading:
        return self._newest.odometry


class RoboMasterImu(Imu):
    """``chassis push attitude``: angles; rates are worked out from them, and of accelerations only gravity is known."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def reading(self) -> ImuReading:
        return self._newest.imu


class RoboMasterBattery(Battery):
    """``robot battery ?``: the charge and nothing else."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def state(self) -> BatteryState:
        return self._newest.battery


class RoboMasterMotionStatus(MotionStatus):
    """``chassis push status``."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def flags(self) -> MotionFlags:
        return self._newest.flags
