"""Values of the API that only a client or only few robots have; all others are in ``roboglot.wire.slamware``.

Read leniently: what a field robot may leave out has a default.
"""

from __future__ import annotations

from enum import IntEnum, StrEnum
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from roboglot.wire.slamware.artifact import Metadata
from roboglot.wire.slamware.geometry import Point, Pose3D
from roboglot.wire.slamware.motion import ActionState
from roboglot.wire.slamware.system import LaserPoint


class Scan(msgspec.Struct):
    """One turn of the lidar, and where the robot was then (map)."""

    pose: Pose3D
    laser_points: list[LaserPoint]

    def arrays(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Angles (rad, from straight ahead, counter-clockwise) and distances (m; inf: nothing came back)."""
        angles = np.fromiter((p.angle for p in self.laser_points), np.float64, len(self.laser_points))
        there = (p.distance if p.valid else np.inf for p in self.laser_points)
        return angles, np.fromiter(there, np.float64, len(self.laser_points))


class Shutdown(msgspec.Struct):
    """Minutes until it is off, and from then until it starts again (0: it does not)."""

    shutdown_time_interval: int = 0
    restart_time_interval: int = 0


class RestartMode(StrEnum):
    """What is to be restarted."""

    SOFT = "RestartModeSoft"
    HARD = "RestartModeHard"
    BASE = "RestartModeBase"


class Restart(msgspec.Struct):
    """What is to be restarted."""

    mode: RestartMode = RestartMode.SOFT


class Parameter(msgspec.Struct):
    """A parameter and its new value."""

    param: str
    value: str | float


class NetworkMode(IntEnum):
    """What the network is to do."""

    ACCESS_POINT = 0
    STATION = 1
    WIFI_OFF = 2
    DHCP_OFF = 3
    DHCP_ON = 4


class NetworkOptions(msgspec.Struct):
    """The network to open (both may be absent) or to join."""

    ssid: str | None = None
    password: str | None = None


class NetworkRequest(msgspec.Struct):
    """Change the network."""

    networkmode: NetworkMode
    options: NetworkOptions = msgspec.field(default_factory=NetworkOptions)


class NetworkStatus(msgspec.Struct):
    """``quality`` in percent."""

    mode: str = ""
    ssid: str = ""
    ip: str = ""
    mac: str = ""
    quality: float = 0
    ethip1: str = ""


class NetworkStatusAnswer(msgspec.Struct):
    """The API wraps it."""

    networkstatus: NetworkStatus


class Route(msgspec.Struct):
    """Which way out comes first."""

    priority: str


class Apn(msgspec.Struct):
    """The mobile network's access point."""

    apn: str


class RawImu(msgspec.Struct):
    """Raw acceleration, turning rates, compass; in counts from ``get_imu_raw_adc_data``."""

    acc_x: float = 0
    acc_y: float = 0
    acc_z: float = 0
    gyro_x: float = 0
    gyro_y: float = 0
    gyro_z: float = 0
    comp_x: float = 0
    comp_y: float = 0
    comp_z: float = 0
    timestamp: int = 0


class Colour(msgspec.Struct):
    """Parts of 255."""

    red: int = 0
    green: int = 0
    blue: int = 0


class LightControl(msgspec.Struct, rename="camel"):
    """What one half of a channel shows from now on; times in ms."""

    channel: Literal["One", "Two"]
    control_part: Literal["Left", "Right"]
    mode: Literal["AlwaysBright", "Breathe", "Blink", "HorseLamp"]
    color: Colour
    brightness_end_color: Colour | None = None
    bright_ms: int = 0
    off_ms: int = 0


class JackStatus(msgspec.Struct):
    """``stage``: 2 down, 3 moving, 5 up, 4 in between."""

    stage: int
    actual_pos: int = 0
    alarm: int = 0
    drv_status: int = 0


class DisabledSensor(msgspec.Struct, rename="camel"):
    """A sensor that is switched off; not ``is_always``: until the robot restarts."""

    id: int
    is_always: bool


class SensorSwitch(msgspec.Struct, rename="camel"):
    """Switch a sensor."""

    id: int
    is_enabled: bool
    is_always: bool = False


class Registration(msgspec.Struct):
    """The name of a new dock."""

    metadata: Metadata = None


class NewOrigin(msgspec.Struct):
    """A place of the map."""

    new_origin: Point


class Strategy(msgspec.Struct):
    """The one to use."""

    strategy: str


class FirmwareInfo(msgspec.Struct):
    """A version that the maker offers; nothing in it: there is none."""

    manufacturer: str = ""
    model: str = ""
    firmware: str = ""
    firmware_id: str = ""


class Outcome(msgspec.Struct):
    """Whether it has begun, and why not."""

    result: bool = True
    reason: str = ""
    msg: str = ""


class UpdateProgress(msgspec.Struct):
    """The step and its share in percent; ``status``: 0 success, 1 error, 2 nothing begun, 3 under way."""

    current_step: int = 0
    current_step_name: str = ""
    current_step_progress: float = 0
    total_steps: int = msgspec.field(default=0, name="toptalSteps")  # the vendor's spelling
    status: int = 0
    error_code: int = 0


class InstalledApp(msgspec.Struct):
    """An app."""

    name: str
    version: str = ""


class TrackQuery(msgspec.Struct):
    """From the robot unless ``start_point`` is given, on this floor unless another one is."""

    end_point: Point
    start_point: Point | None = None
    building: str = ""
    floor: str = ""
    with_direction: bool = False


class PoseRelation(StrEnum):
    """Where the robot is."""

    IN = "in_elevator"
    AT_SILL = "close_to_elevator_sill"
    OUT = "out_of_elevator"


class ElevatorInfo(msgspec.Struct):
    """An elevator, and where to wait for it."""

    elevator_id: str
    door_type: str = ""
    front_scheduling_poses: list[Pose3D] = []
    rear_scheduling_poses: list[Pose3D] = []


class ActionReport(msgspec.Struct):
    """An action under way, or what is left of one that ended: then it has neither name nor stage."""

    action_id: int
    state: ActionState
    action_name: str = ""
    stage: str = ""
