"""Obstacles below or above the lidar's plane, by depth camera and time-of-flight sensors.

Floors and ramps are no obstacles: only what rises more steeply than a wheel could climb, and higher than a foot steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.motion.gripper import Gripper, GripperStatus
from roboglot.model.components.sensing.depth_camera import DepthCamera, DepthImage
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight, ZoneDistances
from roboglot.model.geometry import Vector3
from roboglot.model.robot import Robot

GRASP, GRASP_SIDE = 0.6, 0.12  # m ahead and aside that an object in the gripper covers

Points = NDArray[np.float64]
NONE: Points = np.empty((0, 2))


@dataclass(frozen=True, slots=True)
class LowView:
    """One look, x and y in base_link (n, 2; m): what stands there, and where there is floor."""

    obstacles: Points
    floor: Points


class LowSight:
    """Looks when asked, at what the sensors measure then."""

    def __init__(self, robot: Robot) -> None:
        from roboglot.kernels.depth import sort_out  # it needs Numba

        self._robot, self._height, self._radius = robot, robot.description.height, robot.description.radius
        self._last: tuple[DepthImage, tuple[Points, Points]] | None = None  # the newest image and what it showed
        self._zones: dict[str, tuple[NDArray[np.float32], Vector3, NDArray[np.float64], Points]] = {}  # what they see
        self._sort_out: Callable[[Points, Points, Points, float, float], tuple[Points, Points]] = sort_out

    def look(self) -> LowView:
        """All sensors together; nothing for a robot without any."""
        robot, views = self._robot, list[tuple[Points, Points]]()
        if DepthCamera in robot and (image := robot[DepthCamera].image) is not None:
            views.append(self._in_image(image))
        if TimeOfFlight in robot:
            eyes = robot[TimeOfFlight]
            views += [self._in_zones(name, eyes.reading(name)) for name in eyes.names]
        if not views:
            return LowView(NONE, NONE)
        obstacles = np.concatenate([standing for standing, _ in views])
        if len(obstacles) and Gripper in robot and robot[Gripper].status is not GripperStatus.OPEN:
            held = (obstacles[:, 0] > 0.0) & (obstacles[:, 0] < GRASP) & (np.abs(obstacles[:, 1]) < GRASP_SIDE)
            obstacles = obstacles[~held]
        return LowView(obstacles, np.concatenate([floor for _, floor in views]))

    def _in_image(self, image: DepthImage) -> tuple[Points, Points]:
        """Return obstacle and floor points of a depth image; a slow camera's image is sorted only once."""
        if self._last is None or self._last[0] is not image:
            mount, depths = np.array((image.mount.x, image.mount.y, image.mount.z)), image.depths.astype(np.float64)
            self._last = image, self._sort_out(image.rays, depths, mount, self._height, self._radius)
        return self._last[1]

    def _in_zones(self, name: str, reading: ZoneDistances) -> tuple[Points, Points]:
        """The same in the zones of a time-of-flight sensor."""
        known = self._zones.get(name)
        if known is None or known[0] is not reading.rays or known[1] is not reading.eye:
            rays = reading.rays.astype(np.float64).reshape(*reading.distances.shape, 3)
            known = reading.rays, reading.eye, rays, np.array((reading.eye.x, reading.eye.y, reading.eye.z))
            self._zones[name] = known
        _, _, rays, eye = known
        return self._sort_out(rays, reading.distances.astype(np.float64), eye, self._height, self._radius)
