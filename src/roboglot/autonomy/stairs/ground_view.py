"""View of the ground ahead, from several readings of the time-of-flight sensors in motion. Knows no stairs."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.scan_points import ScanReader
from roboglot.autonomy.stairs.finder import FLOOR, STEP_MAX, StepEdge, find_drop, find_riser
from roboglot.model.components.motion.stair_alignment import StairDirection
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight
from roboglot.model.geometry import Pose, Vector3
from roboglot.model.robot import Robot
from roboglot.values import dataclass

LOOKS_MAX = 15  # kept; the oldest is dropped first
SURE = 0.93  # of a sensor's range within which floor would have been seen
DEEP = 0.04  # m below the floor from which a point does not belong to it
HINTS = 4  # possible points of a step that justify a closer look
STEEP = 0.15  # rad below the horizon from which a ray without an echo counts

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Look:
    """Reading at ``pose`` (odom): ``points`` (n x 3), and rays' crossings of the floor's plane (m x 2), base_link."""

    pose: Pose
    points: Points
    passed: Points


class StairSight:
    """View that is updated by ``look``, at most at the sensors' rate."""

    def __init__(self, robot: Robot) -> None:
        self._robot, self._scans = robot, ScanReader()
        self._looks: deque[_Look] = deque(maxlen=LOOKS_MAX)
        self._stamp = -math.inf

    def forget(self) -> None:
        """Forget all readings."""
        self._looks.clear()
        self._stamp = -math.inf

    def look(self) -> bool:
        """Add the sensors' present readings; return False if there is nothing new."""
        seen = _through_zones(self._robot)
        if seen is None or seen[0] <= self._stamp:
            return False
        self._stamp, points, passed = seen
        self._looks.append(_Look(self._robot[Odometry].reading.pose, points, passed))
        return True

    def hints(self, direction: StairDirection) -> bool:
        """Return whether the present reading alone shows a possible step: quick, within the sensors' range."""
        seen = _through_zones(self._robot)
        if seen is None:
            return False
        _, points, passed = seen
        if direction is StairDirection.DOWN:
            return len(passed) >= HINTS
        return int(((points[:, 2] > FLOOR) & (points[:, 2] < STEP_MAX)).sum()) >= HINTS

    def find(self, direction: StairDirection) -> StepEdge | None:
        """Return the edge of the first step by all readings, in the present base_link; None: there is none."""
        if not self._looks:
            return None
        here = self._robot[Odometry].reading.pose
        points = np.concatenate([_moved(look.points, look.pose.relative_to(here)) for look in self._looks])
        if direction is StairDirection.UP:
            return find_riser(points, self._walls())
        passed = np.concatenate([_moved(look.passed, look.pose.relative_to(here)) for look in self._looks])
        return find_drop(points[np.abs(points[:, 2]) < FLOOR, :2], passed)

    def _walls(self) -> Points | None:
        scan = self._robot[Lidar].scan if Lidar in self._robot else None
        return None if scan is None else self._scans.read(scan).points


def _through_zones(robot: Robot) -> tuple[float, Points, Points] | None:
    """Return time, points and crossings with the floor's plane of the time-of-flight sensors that look ahead."""
    stamp, points, passed = math.inf, [], []
    eyes = robot[TimeOfFlight]
    for name in eyes.names:
        reading = eyes.reading(name)
        if reading.eye.x <= 0.0:
            continue
        stamp = min(stamp, reading.stamp)
        points.append(reading.points.astype(np.float64))
        rays, ways = reading.rays.astype(np.float64), reading.distances.reshape(-1)
        to_floor = np.divide(reading.eye.z, -rays[:, 2], out=np.full(len(rays), np.inf), where=rays[:, 2] < -STEEP)
        sure = (to_floor < reading.range_max * SURE) & (ways > to_floor * (1.0 + DEEP / reading.eye.z))
        passed.append(_at_floor(rays[sure], to_floor[sure], reading.eye))
    if not points:
        return None
    return stamp, np.concatenate(points), np.concatenate(passed)


def _at_floor(rays: Points, ways: Points, eye: Vector3) -> Points:
    crossed: Points = rays[:, :2] * ways[:, None] + (eye.x, eye.y)
    return crossed


def _moved(points: Points, pose: Pose) -> Points:
    """Return ``points`` of the frame at ``pose`` in the frame of ``pose`` itself; heights stay."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    moved = points.copy()
    moved[:, 0] = c * points[:, 0] - s * points[:, 1] + pose.x
    moved[:, 1] = s * points[:, 0] + c * points[:, 1] + pose.y
    return moved
