"""What stands around below or above the lidar's plane, as depth camera and time-of-flight sensors see it.

Floors and ramps are no obstacles: only what rises more steeply than a wheel could climb, and higher than a foot steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.motion.gripper import Gripper, GripperStatus
from roboglot.model.components.sensing.depth_camera import DepthCamera, DepthImage
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight, ZoneDistances
from roboglot.model.robot import Robot

LOW, FLOOR = 0.10, 0.04  # m above the floor: what is lower is stepped over; is floor, for sure
STEEP = 0.7  # rise per way from which a surface is a wall
NEAR = 2.5  # m from base_link within which depth is precise enough
GRASP, GRASP_SIDE = 0.6, 0.12  # m ahead and aside where what the gripper holds is

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
        self._robot = robot

    def look(self) -> LowView:
        """All sensors together; nothing for a robot without any."""
        robot, grids = self._robot, list[Points]()
        if DepthCamera in robot and (image := robot[DepthCamera].image) is not None:
            grids.append(_depth_grid(image))
        if TimeOfFlight in robot:
            eyes = robot[TimeOfFlight]
            zones = [_zone_grid(eyes.reading(name)) for name in eyes.names]
            grids += [np.stack(zones)] if len({grid.shape for grid in zones}) == 1 else zones
        if not grids:
            return LowView(NONE, NONE)
        seen = [_sorted_out(grid, robot.description.height) for grid in grids]
        obstacles = np.concatenate([view.obstacles for view in seen])
        if Gripper in robot and robot[Gripper].status is not GripperStatus.OPEN:
            held = (obstacles[:, 0] > 0.0) & (obstacles[:, 0] < GRASP) & (np.abs(obstacles[:, 1]) < GRASP_SIDE)
            obstacles = obstacles[~held]
        outside = np.hypot(obstacles[:, 0], obstacles[:, 1]) > robot.description.radius
        return LowView(obstacles[outside], np.concatenate([view.floor for view in seen]))


def _sorted_out(grid: Points, height: float) -> LowView:
    """What of ``grid`` (any number of sensors, rows from above, columns, x y z; NaN: no echo) stands, what is floor."""
    away, z = np.hypot(grid[..., 0], grid[..., 1]), grid[..., 2]
    upper, beside = z[..., :-1, :], away[..., :-1, :]
    with np.errstate(invalid="ignore"):
        rise, way = upper - z[..., 1:, :], beside - away[..., 1:, :]  # each against what is seen right below
        stands = (rise > STEEP * np.maximum(way, 0.0)) & (upper > LOW) & (upper < height) & (beside < NEAR)
        floor = (np.abs(z) < FLOOR) & (away < NEAR)
    return LowView(grid[..., :-1, :, :][stands][:, :2], grid[floor][:, :2])


def _depth_grid(image: DepthImage) -> Points:
    """Every pixel's place in base_link."""
    depths = np.where(np.isfinite(image.depths), image.depths, np.nan).astype(np.float64)
    mount = np.array((image.mount.x, image.mount.y, image.mount.z))
    rays = _rays(image.depths.shape, image.width, image.height, image.attitude.pitch)
    grid: Points = rays * depths[..., None] + mount
    return grid


@lru_cache(maxsize=64)
def _rays(shape: tuple[int, int], width: float, height: float, pitch: float) -> Points:
    """Every pixel's way through base_link for 1 m along the optical axis."""
    rows, columns = shape
    across = np.tan(np.linspace(width / 2, -width / 2, columns))
    down = np.tan(np.linspace(height / 2, -height / 2, rows))
    left, up = np.meshgrid(across, down)
    c, s = math.cos(pitch), math.sin(pitch)
    rays: Points = np.stack((c + s * up, left, c * up - s), axis=-1)
    rays.setflags(write=False)
    return rays


def _zone_grid(reading: ZoneDistances) -> Points:
    """Every zone's place in base_link."""
    ways = np.where(np.isfinite(reading.distances), reading.distances, np.nan).astype(np.float64)
    rays = reading.rays.astype(np.float64).reshape(*ways.shape, 3)
    grid: Points = rays * ways[..., None] + np.array((reading.eye.x, reading.eye.y, reading.eye.z))
    return grid
