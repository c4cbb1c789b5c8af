"""Converts units, words and errors between Slamware and the model. Both use the same frames."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from roboglot.clients.errors import ClientError
from roboglot.clients.slamware import SlamwareRefused
from roboglot.clients.slamware.values import Scan
from roboglot.drivers.errors import model_errors
from roboglot.extras import lazy
from roboglot.model.errors import (
    Blocked,
    DockNotFound,
    InvalidGoal,
    NotFound,
    NotLocalized,
    Refused,
    RobotError,
    Unreachable,
)
from roboglot.model.geometry import Orientation, Point, Pose, Vector3, wrap_angle
from roboglot.model.maps import OccupancyGrid
from roboglot.model.sensing import BatteryState, ImuReading, LaserScan, Supply
from roboglot.wire.slamware.chapters.motion import ActionState
from roboglot.wire.slamware.chapters.slam.explore_map import ExploreMap
from roboglot.wire.slamware.chapters.slam.localization import ImuData
from roboglot.wire.slamware.chapters.system.system import BatteryPack, DockingStatus, PowerStatus
from roboglot.wire.slamware.geometry import Location, Pose3D

if TYPE_CHECKING:
    import numpy as np
else:
    np = lazy("numpy")

RANGE_MAX = 40.0  # m; the API does not report the range of the lidar
RAYS_MAX = 4096
REASONS: dict[str, type[RobotError]] = {
    "CANNOT_REACH_TARGET": Unreachable,
    "PATH_OCCUPIED": Blocked,
    "SEARCH_DOCK_FAILED": DockNotFound,
    "LOCALIZATION_LOST": NotLocalized,
}
STATUSES: dict[int | str, type[RobotError]] = {400: InvalidGoal, 403: Refused, 404: NotFound, 501: Refused}


def robot_errors() -> AbstractContextManager[None]:
    """Raise the client's errors as the model's."""
    return model_errors(_translated)


def _translated(error: ClientError) -> RobotError | None:
    match error:
        case SlamwareRefused():
            return STATUSES.get(error.code, RobotError)(error.words or str(error))
    return None


def failure(state: ActionState) -> RobotError:
    """Return the error of a failed action."""
    kind = next((kind for word, kind in REASONS.items() if word in state.reason), RobotError)
    return kind(state.reason or "failed")


def pose_of(pose: Pose3D) -> Pose:
    """Return the pose in the plane."""
    return Pose(pose.x, pose.y, wrap_angle(pose.yaw))


def pose3d(pose: Pose) -> Pose3D:
    """Return the pose in the form of the API."""
    return Pose3D(pose.x, pose.y, 0.0, pose.yaw)


def battery_of(status: PowerStatus, pack: BatteryPack | None) -> BatteryState:
    """Return the battery state; the API reports no voltage and no cycles (0), and only newer firmware the pack."""
    docked = status.docking_status is DockingStatus.ON_DOCK
    supply = Supply.CONTACTS if docked else Supply.WIRE if status.is_dc_connected else Supply.NONE
    return BatteryState(
        percentage=min(max(status.battery_percentage / 100, 0.0), 1.0),
        voltage=0.0,
        current=pack.current / 1000 if pack else 0.0,
        temperature=max(pack.temp) / 10 if pack and pack.temp else 0.0,
        charging=status.is_charging,
        cycles=0,
        supply=supply,
    )


def imu_of(data: ImuData, stamp: float) -> ImuReading:
    """Return the reading; both sides use REP-103 axes and signs."""
    euler, gyro, acc = data.euler_angle, data.gyro, data.acc
    return ImuReading(
        stamp, Orientation(euler.x, euler.y, euler.z), Vector3(gyro.x, gyro.y, gyro.z), Vector3(acc.x, acc.y, acc.z)
    )


def scan_of(scan: Scan, stamp: float) -> LaserScan:
    """Return the scan in base_link, sorted into as many even steps as points; the nearest point of a step counts."""
    angles, distances = scan.arrays()
    count = min(max(len(angles), 1), RAYS_MAX)
    step = 2 * np.pi / count
    ranges = np.full(count, np.inf)
    index = np.rint(np.remainder(angles + np.pi, 2 * np.pi) / step).astype(np.int64) % count
    np.minimum.at(ranges, index, distances)
    return LaserScan(stamp, ranges.astype(np.float32), -np.pi, step, 0.05, RANGE_MAX)


def grid_of(explored: ExploreMap) -> OccupancyGrid:
    """Return the grid; free cells are positive in the API and negative in the model."""
    cells = np.clip(-explored.cells.astype(np.int16), -127, 127).astype(np.int8)
    return OccupancyGrid(cells, explored.resolution, Point(explored.x, explored.y))


def explored_of(grid: OccupancyGrid) -> ExploreMap:
    """Return the map in the form of the API."""
    return ExploreMap(grid.origin.x, grid.origin.y, grid.resolution, (-grid.log_odds).astype(np.int8))


def location(point: Point) -> Location:
    """Return a goal in the form of the API."""
    return Location(point.x, point.y)
