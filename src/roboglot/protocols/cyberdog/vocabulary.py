"""Translation of the model's values to this protocol's words, units and structures. Knows no message or component."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from roboglot.model.components.mapping.map_library import Label
from roboglot.model.components.motion.feet import Foot
from roboglot.model.components.motion.gaits import FOOT_LIFT_MAX, FOOT_LIFT_MIN, GAITS, Gait
from roboglot.model.components.motion.legs import BodyPose, FootLift
from roboglot.model.geometry import Orientation, Point, Pose, Twist
from roboglot.model.maps import OccupancyGrid
from roboglot.model.sensing import LaserScan
from roboglot.protocols.cyberdog.chapters.motion.motion_table import WALKS

ALL_FEET = 0x0F
STRAIGHT_DOWN = 2  # ``value`` of a servo frame
TOED_IN = 0.02  # m
LASER_MIN = 0.05  # m: closer returns are from the body itself and are omitted


def wifi_strength(signal: float) -> int:
    """Return 0..100 from dBm: 100 at -50, 0 at -100."""
    return round(max(0.0, min(100.0, 2.0 * (signal + 100.0))))


def percent(share: float) -> int:
    """Return 0..100 from 0..1."""
    return round(100.0 * max(0.0, min(1.0, share)))


def pose_of(pose: Pose) -> dict[str, float]:
    """Return px, py, pz (m), and the heading as a quaternion qx, qy, qz, qw about z."""
    return {
        "px": pose.x,
        "py": pose.y,
        "pz": 0.0,
        "qx": 0.0,
        "qy": 0.0,
        "qz": math.sin(pose.yaw / 2.0),
        "qw": math.cos(pose.yaw / 2.0),
    }


def points_of(points: Iterable[Point]) -> list[dict[str, float]]:
    """Return a list of {px, py}, m."""
    return [{"px": point.x, "py": point.y} for point in points]


def grid_of(grid: OccupancyGrid) -> dict[str, object]:
    """Return the map structure: -1 unknown, 0 free, 100 occupied (as clients test), rows from the smallest y."""
    cells = np.where(grid.log_odds > 0, 100, np.where(grid.log_odds < 0, 0, -1))
    origin = pose_of(Pose(grid.origin.x, grid.origin.y))
    size = {"resolution": grid.resolution, "width": grid.width, "height": grid.height}
    return {**size, **origin, "data": cells.ravel().tolist()}


def no_grid() -> dict[str, object]:
    """Return the map structure of an answer without a map."""
    return {**dict.fromkeys(("resolution", "width", "height", *pose_of(Pose())), 0), "data": []}


def laser_of(scan: LaserScan, pose: Pose) -> list[dict[str, float]]:
    """Return the scan as points in the map, with base_link at ``pose`` (map)."""
    seen = np.isfinite(scan.ranges) & (scan.ranges >= max(LASER_MIN, scan.range_min))
    lidar = pose.compose(scan.mount)
    ranges, angles = scan.ranges[seen].astype(float), scan.angles[seen] + lidar.yaw
    xs, ys = lidar.x + ranges * np.cos(angles), lidar.y + ranges * np.sin(angles)
    # Millimetres are finer than any lidar, at a third of the text.
    return [{"px": x, "py": y} for x, y in zip(xs.round(3).tolist(), ys.round(3).tolist(), strict=True)]


def label_of(label: Label) -> dict[str, object]:
    """Return a label in the form of 6002 and 6003."""
    return {"labelName": label.name, "physicX": label.point.x, "physicY": label.point.y}


def twist_of(motion: int, vel_des: Sequence[float]) -> Twist:
    """Return ``vel_des`` [x, y, yaw] limited to what the walk ``motion`` can do; any other length: standing still."""
    x, y, yaw = vel_des if len(vel_des) == 3 else (0.0, 0.0, 0.0)
    return GAITS[WALKS.get(motion, Gait.TROT_SLOW)].clamp(Twist(x, y, yaw))  # a user-defined gait counts as a slow walk


def body_of(pos_des: Sequence[float], rpy_des: Sequence[float]) -> BodyPose:
    """Return the body pose: ``pos_des`` [x, y, z], m (z 0: same height), ``rpy_des``, rad; other lengths: zeros."""
    x, y, z = pos_des if len(pos_des) == 3 else (0.0, 0.0, 0.0)
    roll, pitch, yaw = rpy_des if len(rpy_des) == 3 else (0.0, 0.0, 0.0)
    return BodyPose(z or None, Orientation(roll, pitch, yaw), Point(x, y))


def feet_of(contact: int) -> frozenset[Foot]:
    """Return the feet on the ground, from bits: right front (lowest), left front, right rear, left rear; 0: all."""
    return frozenset(foot for bit, foot in enumerate(Foot) if (contact & ALL_FEET or ALL_FEET) & (1 << bit))


def lift_of(step_height: Sequence[float], value: int = STRAIGHT_DOWN) -> FootLift | None:
    """Return the foot lift for ``step_height`` [front, rear] (m), limited to what legs can do; None: default.

    ``value`` 0: the feet come down nearer to the middle; 2: straight below the hips.
    """
    inward = TOED_IN if value == 0 else 0.0
    if len(step_height) < 2 or not all(height > 0.0 for height in step_height[:2]):
        return FootLift(inward=inward) if inward else None
    front, rear = (max(FOOT_LIFT_MIN, min(FOOT_LIFT_MAX, height)) for height in step_height[:2])
    return FootLift(front, rear, inward)
