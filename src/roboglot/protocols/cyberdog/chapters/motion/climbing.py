"""Walks with terrain sensing: foot lift for obstacles ahead. Knows no motion by number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.motion.gaits import FOOT_LIFT_MAX
from roboglot.model.components.motion.legs import FootLift
from roboglot.model.components.sensing.depth_camera import DepthCamera
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot

AHEAD = (0.15, 0.8)  # m in front of base_link that are examined
BESIDE = 0.15  # m
FLOOR = 0.02  # m above the floor up to which points belong to it
PASSED = 1.2  # m after which earlier sightings lie behind the robot
ROOM = 0.02  # m of clearance above what the feet step over

Points = NDArray[np.float32]


def sees(robot: Robot) -> bool:
    """Return whether the robot has sensors for the ground ahead."""
    return DepthCamera in robot or TimeOfFlight in robot


class WayAhead:
    """Height of the ground ahead, and a body length behind, where the feet may still be."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._height = 0.0
        self._seen_at = Pose()  # odom

    def lift(self, wanted: FootLift | None) -> FootLift:
        """Return ``wanted``, raised above obstacles as far as the legs can."""
        wanted, height = wanted or FootLift(), _height_ahead(self._robot)
        here = self._robot[Odometry].reading.pose if Odometry in self._robot else Pose()
        if FLOOR < height >= self._height or here.distance_to(self._seen_at) > PASSED:
            self._height, self._seen_at = height, here
        needed = self._height + ROOM
        if not FLOOR + ROOM < needed <= FOOT_LIFT_MAX:
            return wanted
        return replace(wanted, front=max(wanted.front, needed), rear=max(wanted.rear, needed))


def _height_ahead(robot: Robot) -> float:
    """Return the height of the tallest obstacle ahead, m."""
    points = _seen(robot)
    x, y, z = points.T
    ahead = z[(x > AHEAD[0]) & (x < AHEAD[1]) & (np.abs(y) < BESIDE)]
    return float(ahead.max()) if len(ahead) else 0.0


def _seen(robot: Robot) -> Points:
    if DepthCamera in robot and (image := robot[DepthCamera].image) is not None:
        return image.points
    if TimeOfFlight not in robot:
        return np.empty((0, 3), np.float32)
    eyes = robot[TimeOfFlight]
    return np.concatenate([eyes.reading(name).points for name in eyes.names])
