"""Answers read more leniently than the door writes them: what a field robot may leave out has a default.

All other values of the API are in ``roboglot.wire.slamware``, for both ends.
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
        """Angles (rad, from straight ahead, counter-clockwise) and distances (m; inf: nothing came back)."""
        angles = np.fromiter((p.angle for p in self.laser_points), np.float64, len(self.laser_points))
        there = (p.distance if p.valid else np.inf for p in self.laser_points)
        return angles, np.fromiter(there, np.float64, len(self.laser_points))


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


class JackStatus(msgspec.Struct):
    """``stage``: 2 down, 3 moving, 5 up, 4 in between."""

    stage: int
    actual_pos: int = 0
    alarm: int = 0
    drv_status: int = 0


class Outcome(msgspec.Struct):
    """True if it has begun, else the reason."""

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
