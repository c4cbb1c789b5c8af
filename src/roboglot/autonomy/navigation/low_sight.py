"""Obstacles below or above the lidar's plane, by depth camera, time-of-flight sensors and bumper.

Floors and ramps are not obstacles: only surfaces too steep for wheels and too high for feet are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Set
from operator import is_

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.motion.gripper import Gripper, GripperStatus
from roboglot.model.components.sensing.bumper import Bumper
from roboglot.model.components.sensing.depth_camera import DepthCamera, DepthImage
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight, ZoneDistances
from roboglot.model.robot import Robot
from roboglot.values import dataclass

GRASP, GRASP_SIDE = 0.6, 0.12  # m ahead and aside that an object in the gripper covers

ZONES = {"front": 0.0, "left": math.pi / 2, "rear": math.pi, "right": -math.pi / 2}  # rad: middles of the bumper's
TOUCHED = np.linspace(-0.6, 0.6, 9)  # rad around a zone's middle
BESIDE = 0.03  # m beyond the hull that what touches it may be

Points = NDArray[np.float64]
Segmentation = Callable[[Points, Points, Points, float, float], tuple[Points, Points]]
NONE: Points = np.empty((0, 3))


@dataclass(frozen=True, slots=True)
class LowView:
    """Points of obstacles with their heights, and of floor with the heights seen above it, in base_link (n, 3; m)."""

    obstacles: Points
    floor: Points


class LowSight:
    """Detection of low obstacles from the sensors' present readings."""

    def __init__(self, robot: Robot) -> None:
        from roboglot.kernels.depth import segment_ground, segment_ground_all  # it needs Numba

        self._robot, self._height, self._radius = robot, robot.description.height, robot.description.radius
        self._last: tuple[DepthImage, tuple[Points, Points]] | None = None  # the newest image and its points
        self._eyes: list[object] = []  # rays and places of the zones' sensors at the last look
        self._rays, self._places = np.empty((0, 0, 0, 3)), np.empty((0, 3))  # … the same as arrays
        self._distances = np.empty((0, 0, 0))  # room for theirs
        self._segment: Segmentation = segment_ground
        self._segment_all: Segmentation = segment_ground_all

    def look(self) -> LowView:
        """Return the obstacles and floor of all sensors; empty without sensors."""
        robot, views = self._robot, list[tuple[Points, Points]]()
        if DepthCamera in robot and (image := robot[DepthCamera].image) is not None:
            views.append(self._in_image(image))
        if TimeOfFlight in robot:
            views.append(self._in_zones(robot[TimeOfFlight].readings))
        if Bumper in robot and (pressed := robot[Bumper].pressed):
            views.append((self._touching(pressed), NONE))
        if not views:
            return LowView(NONE, NONE)
        obstacles = _joined([standing for standing, _ in views if len(standing)])
        if len(obstacles) and Gripper in robot and robot[Gripper].status is not GripperStatus.OPEN:
            held = (obstacles[:, 0] > 0.0) & (obstacles[:, 0] < GRASP) & (np.abs(obstacles[:, 1]) < GRASP_SIDE)
            obstacles = obstacles[~held]
        return LowView(obstacles, _joined([floor for _, floor in views if len(floor)]))

    def _touching(self, zones: Set[str]) -> Points:
        """Return points beside the pressed zones: what no sensor sees is there, at an unknown height."""
        angles = np.concatenate([angle + TOUCHED for zone, angle in ZONES.items() if zone in zones] or [NONE[:, 0]])
        away = self._radius + BESIDE
        return np.column_stack((away * np.cos(angles), away * np.sin(angles), np.full(len(angles), self._height)))

    def _in_image(self, image: DepthImage) -> tuple[Points, Points]:
        """Return obstacle and floor points of a depth image; a slow camera's image is sorted only once."""
        if self._last is None or self._last[0] is not image:
            mount, depths = np.array((image.mount.x, image.mount.y, image.mount.z)), image.depths.astype(np.float64)
            self._last = image, self._segment(image.rays, depths, mount, self._height, self._radius)
        return self._last[1]

    def _in_zones(self, readings: list[ZoneDistances]) -> tuple[Points, Points]:
        """Return obstacle and floor points in the zones of all time-of-flight sensors."""
        eyes: list[object] = [reading.rays for reading in readings]
        eyes += [reading.eye for reading in readings]
        if len(eyes) != len(self._eyes) or not all(map(is_, eyes, self._eyes)):
            self._eyes, zones = eyes, readings[0].distances.shape
            self._rays = np.array([reading.rays for reading in readings], np.float64).reshape(-1, *zones, 3)
            self._places = np.array([(reading.eye.x, reading.eye.y, reading.eye.z) for reading in readings])
            self._distances = np.empty(self._rays.shape[:3])
        for row, reading in zip(self._distances, readings, strict=True):
            row[:] = reading.distances
        return self._segment_all(self._rays, self._distances, self._places, self._height, self._radius)


def _joined(parts: list[Points]) -> Points:
    """Return the parts as one array; most looks have one or none."""
    if len(parts) > 1:
        return np.concatenate(parts)
    return parts[0] if parts else NONE
