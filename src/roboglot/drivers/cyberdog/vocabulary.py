"""Converts units, words and errors of the CyberDog to the model's. Both use the same frames."""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from roboglot.clients.cyberdog import CyberDogRefused, Heartbeat, NoAnswer, TaskStopped, values
from roboglot.clients.errors import ClientError
from roboglot.drivers.errors import model_errors
from roboglot.extras import lazy
from roboglot.model.components.motion.gaits import Gait
from roboglot.model.components.motion.motions import Motion as Figure
from roboglot.model.components.motion.posture import Posture
from roboglot.model.errors import Busy, Refused, RobotError
from roboglot.model.geometry import Path, Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.sensing import BatteryState, LaserScan, Supply
from roboglot.wire.cyberdog.chapters.motion.motion import Motion
from roboglot.wire.cyberdog.chapters.motion.names import FIGURE_NAMES, WALK_NAMES

if TYPE_CHECKING:
    import numpy as np
else:
    np = lazy("numpy")

RAYS = 360
RANGE_MAX = 12.0  # m; the range of the lidar is not reported
SURE = 100  # log-odds of a cell that the app sees as free or occupied

FIGURES = {number: Figure[name] for number, name in FIGURE_NAMES.items()}
WALKS = {Gait[name]: number for number, name in reversed(list(WALK_NAMES.items()))}  # the first if two share a gait
POSTURES = {
    Motion.EMERGENCY_STOP: Posture.LIMP,
    Motion.LIE_DOWN: Posture.LYING,
    Motion.LIE_DOWN_PASSIVE: Posture.LYING,
    Motion.SIT_DOWN: Posture.SITTING,
}


def posture_of(motion: int) -> Posture:
    """Return the posture of a motion: figures change it, walks keep the dog standing."""
    known = {int(number): posture for number, posture in POSTURES.items()}
    return known.get(motion, Posture.CHANGING if motion in FIGURES else Posture.STANDING)


def robot_errors() -> AbstractContextManager[None]:
    """Raise the client's errors as the model's."""
    return model_errors(_translated)


def _translated(error: ClientError) -> RobotError | None:
    match error:
        case TaskStopped():
            return Busy(str(error))
        case CyberDogRefused() | NoAnswer():
            return Refused(str(error))
    return None


def pose_of(pose: values.Pose) -> Pose:
    """Return the pose in the plane, with the heading of the quaternion."""
    yaw = math.atan2(2 * (pose.qw * pose.qz + pose.qx * pose.qy), 1 - 2 * (pose.qy**2 + pose.qz**2))
    return Pose(pose.px, pose.py, yaw)


def battery_of(beat: Heartbeat) -> BatteryState:
    """Return the battery state; a heartbeat reports only percent and charging."""
    supply = Supply.WIRE if beat.wired_charging else Supply.WIRELESS if beat.wireless_charging else Supply.NONE
    return BatteryState(beat.battery / 100, 0.0, 0.0, 0.0, supply is not Supply.NONE, 0, supply)


def grid_of(grid: values.Grid) -> OccupancyGrid | None:
    """Return the grid (-1 unknown, 0 free, 100 occupied), or None if its cells do not match its size."""
    cells = np.array(grid.data, np.int16)
    if cells.size != grid.width * grid.height:
        return None
    evidence = np.where(cells < 0, 0, np.where(cells > 50, SURE, -SURE)).astype(np.int8)
    return OccupancyGrid(evidence.reshape(grid.height, grid.width), grid.resolution, Point(grid.px, grid.py))


def scan_of(points: values.LaserPoints, pose: Pose, stamp: float) -> LaserScan:
    """Return the map points as a scan from ``pose``, with the nearest point of each degree."""
    xy = np.array([(p.px, p.py) for p in points.laser_point], np.float64).reshape(-1, 2) - (pose.x, pose.y)
    angles = np.arctan2(xy[:, 1], xy[:, 0]) - pose.yaw
    step = 2 * np.pi / RAYS
    ranges = np.full(RAYS, np.inf)
    np.minimum.at(ranges, np.rint(np.remainder(angles + np.pi, 2 * np.pi) / step).astype(int) % RAYS, np.hypot(*xy.T))
    return LaserScan(stamp, ranges.astype(np.float32), -np.pi, step, 0.05, RANGE_MAX)


def path_of(path: values.PlannedPath) -> Path:
    """Return the remaining path."""
    return Path.through((point.px, point.py) for point in path.path_point)
