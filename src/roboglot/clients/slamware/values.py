"""Answers with defaults for fields that real robots may leave out, unlike our door.

All other values of the API are in ``roboglot.wire.slamware``, shared by both ends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec

from roboglot.extras import lazy
from roboglot.wire.slamware.chapters.motion import ActionState
from roboglot.wire.slamware.chapters.system.system import LaserPoint
from roboglot.wire.slamware.geometry import Pose3D

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = lazy("numpy")


class Scan(msgspec.Struct):
    """One turn of the lidar with the pose at that time (map frame)."""

    pose: Pose3D
    laser_points: list[LaserPoint]

    def arrays(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return angles (rad, counter-clockwise from straight ahead) and distances (m; inf: no echo)."""
        angles = np.fromiter((p.angle for p in self.laser_points), np.float64, len(self.laser_points))
        there = (p.distance if p.valid else np.inf for p in self.laser_points)
        return angles, np.fromiter(there, np.float64, len(self.laser_points))


class TaskMoveOptions(msgspec.Struct):
    """Drive settings of tasks, as ``MoveOptions``; a robot may have flags and modes that its manual does not list."""

    mode: int = 0
    flags: list[str | None] | int | None = None
    yaw: float | None = None
    acceptable_precision: float | None = None
    fail_retry_count: int | None = None
    speed_ratio: float | None = None


class NetworkStatus(msgspec.Struct):
    """State of the network; ``quality`` in percent."""

    mode: str = ""
    ssid: str = ""
    ip: str = ""
    mac: str = ""
    quality: float = 0
    ethip1: str = ""


class NetworkStatusAnswer(msgspec.Struct):
    """The API's wrapper of NetworkStatus."""

    networkstatus: NetworkStatus


class RawImu(msgspec.Struct):
    """Raw acceleration, turning rates and compass; from ``get_imu_raw_adc_data`` in counts."""

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


class JackStatus(msgspec.Struct):
    """State of a jack; ``stage``: 2 down, 3 moving, 4 in between, 5 up."""

    stage: int
    actual_pos: int = 0
    alarm: int = 0
    drv_status: int = 0


class Outcome(msgspec.Struct):
    """Result of a command: True if it has begun, otherwise the reason."""

    result: bool = True
    reason: str = ""
    msg: str = ""


class UpdateProgress(msgspec.Struct):
    """Current step and its progress in percent; ``status``: 0 success, 1 error, 2 not begun, 3 in progress."""

    current_step: int = 0
    current_step_name: str = ""
    current_step_progress: float = 0
    total_steps: int = msgspec.field(default=0, name="toptalSteps")  # the vendor's spelling
    status: int = 0
    error_code: int = 0


class InstalledApp(msgspec.Struct):
    """An installed app."""

    name: str
    version: str = ""


class ElevatorInfo(msgspec.Struct):
    """An elevator, and the poses for waiting in front of it."""

    elevator_id: str
    door_type: str = ""
    front_scheduling_poses: list[Pose3D] = []
    rear_scheduling_poses: list[Pose3D] = []


class ActionReport(msgspec.Struct):
    """A running action, or an ended one, which has neither name nor stage."""

    action_id: int
    state: ActionState
    action_name: str = ""
    stage: str = ""
