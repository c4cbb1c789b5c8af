"""Chapter "system": name plate, power, health, laser scan."""

from __future__ import annotations

from enum import IntEnum, StrEnum

import msgspec

from roboglot.wire.slamware.geometry import Pose3D


class Capability(msgspec.Struct):
    """A plugin of the robot; ``enabled`` is false while it starts."""

    name: str
    version: str
    enabled: bool


class DockingStatus(StrEnum):
    """Docking status."""

    ON_DOCK = "on_dock"
    NOT_ON_DOCK = "not_on_dock"


class PowerStatus(msgspec.Struct, rename="camel"):
    """Battery in percent, source of power, and state of sleep."""

    battery_percentage: int
    docking_status: DockingStatus
    is_charging: bool
    is_dc_connected: bool = msgspec.field(name="isDCConnected")
    power_stage: str
    sleep_mode: str


class BatteryPack(msgspec.Struct):
    """Current in mA (positive: charging), temperatures in tenths of a degree Celsius."""

    current: float
    temp_count: int
    temp: list[int]


class DeviceInfo(msgspec.Struct, rename="camel"):
    """The name plate; ``device_id`` is 32 upper-case hex digits."""

    manufacturer_id: int
    manufacturer_name: str
    model_id: int
    model_name: str
    device_id: str = msgspec.field(name="deviceID")
    hardware_version: str
    software_version: str


class Level(IntEnum):
    """Severity of a health record."""

    HEALTHY = 0
    WARN = 1
    ERROR = 2
    FATAL = 4
    UNKNOWN = 255


class HealthPart(IntEnum):
    """Component of a health record."""

    USER = 0
    SYSTEM = 1
    POWER = 2
    MOTION = 3
    SENSOR = 4
    UNKNOWN = 255


class BaseError(msgspec.Struct, rename="camel"):
    """One health record. The last three fields come from real robots, not from the manual."""

    id: int
    component: HealthPart
    error_code: int
    level: Level
    message: str
    component_error_code: int
    component_error_type: int
    component_error_device_id: int = -1


class BaseHealthInfo(msgspec.Struct, rename="camel"):
    """State of health; the last four fields come from real robots, not from the manual."""

    has_warning: bool
    has_error: bool
    has_fatal: bool
    base_error: list[BaseError]
    has_system_emergency_stop: bool
    has_lidar_disconnected: bool
    has_sdp_disconnected: bool
    has_depth_camera_disconnected: bool


class LaserPoint(msgspec.Struct):
    """Distance (m) and angle (rad from straight ahead, counter-clockwise) as seen from the robot's centre."""

    distance: float
    angle: float
    valid: bool


class LaserScan(msgspec.Struct):
    """One turn of the lidar and the robot's pose at that time. ``laser_points``: LaserPoints, already encoded."""

    pose: Pose3D
    laser_points: msgspec.Raw


def error_code(level: Level, part: HealthPart, code: int) -> int:
    """Return the 32-bit number of a health record, made of level, component and the component's own code."""
    return level << 24 | part << 16 | code


def health_record(level: Level, part: HealthPart, code: int, error_type: int, message: str) -> BaseError:
    """Return a record with its computed numbers; ``error_type`` counts from 1 within the component."""
    number = error_code(level, part, code)
    return BaseError(0, part, number, level, message, code, 1024 * (part + 1) + error_type)


class ImuCounts(msgspec.Struct):
    """Raw values of accelerometer, gyro and compass; ``timestamp`` in ms."""

    acc_x: int
    acc_y: int
    acc_z: int
    gyro_x: int
    gyro_y: int
    gyro_z: int
    comp_x: int
    comp_y: int
    comp_z: int
    timestamp: int


class ImuValues(msgspec.Struct):
    """Values of accelerometer (m/s2), gyro (rad/s) and compass (microtesla); ``timestamp`` in ms."""

    acc_x: float
    acc_y: float
    acc_z: float
    gyro_x: float
    gyro_y: float
    gyro_z: float
    comp_x: float
    comp_y: float
    comp_z: float
    timestamp: int
