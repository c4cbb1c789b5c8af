"""Projection between the camera's picture and the space in front of it, in both directions.

The camera is a pinhole. Boxes are shares of the picture; places are base_link, m.
"""

from __future__ import annotations

import math

import numpy as np

from roboglot.model.components.sensing.camera import Camera
from roboglot.model.geometry import Point, Pose
from roboglot.model.perception import Box
from roboglot.model.sensing import LaserScan
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Extent:
    """Extent of an object: half its width, and its bottom and top relative to the camera's height, m."""

    half: float
    bottom: float
    top: float


class CameraView:
    """The view of one camera as it is mounted now."""

    def __init__(self, camera: Camera) -> None:
        mount = camera.mount
        self._at, self._pitch = Pose(mount.x, mount.y, mount.yaw), mount.pitch
        self._across = 0.5 / math.tan(camera.fov / 2.0)  # focal length in picture widths
        self._down = self._across * camera.width / camera.height

    def nearest(self, box: Box, scan: LaserScan) -> Point | None:
        """Return the nearest lidar return within the middle half of the box, seen from above; None without one."""
        angles, ranges = scan.angles, scan.ranges.astype(float)
        seen = np.isfinite(ranges) & (ranges >= scan.range_min) & (ranges <= scan.range_max)
        lidar = scan.mount.relative_to(self._at)
        x = lidar.x + ranges * np.cos(angles + lidar.yaw)
        y = lidar.y + ranges * np.sin(angles + lidar.yaw)
        # At the camera's height, a column of the picture is a direction.
        right, left = ((0.5 - edge) / self._across for edge in (box.x + box.width / 4, box.x - box.width / 4))
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = y / (x * math.cos(self._pitch))
        inside = seen & (x > 0.0) & (slope >= right) & (slope <= left)
        if not inside.any():
            return None
        index = int(np.argmin(np.where(inside, np.hypot(x, y), np.inf)))
        return self._at.compose(Pose(float(x[index]), float(y[index]))).point

    def extent(self, box: Box, place: Point) -> Extent:
        """Return the extent of an object that fills ``box`` at ``place``."""
        away = max(0.1, Pose(place.x, place.y).relative_to(self._at).x)
        c, s = math.cos(self._pitch), math.sin(self._pitch)

        def height(y: float) -> float:
            up = (0.5 - y) / self._down
            return away * (up * c - s) / max(0.1, c + up * s)

        low, high = height(box.y + box.height / 2), height(box.y - box.height / 2)
        return Extent(away * box.width / (2.0 * self._across), low, high)

    def box(self, extent: Extent, place: Point) -> Box:
        """Return the region of the picture of an object at ``place``; empty behind the camera."""
        seen = Pose(place.x, place.y).relative_to(self._at)
        if seen.x <= 0.1:
            return Box(0.0, 0.0, 0.0, 0.0)
        c, s = math.cos(self._pitch), math.sin(self._pitch)

        def row(height: float) -> float:
            ahead = max(0.1, seen.x * c - height * s)
            return 0.5 - self._down * (seen.x * s + height * c) / ahead

        bottom, top = row(extent.bottom), row(extent.top)
        ahead = max(0.1, seen.x * c - (extent.bottom + extent.top) / 2 * s)
        middle = 0.5 - self._across * seen.y / ahead
        return Box(middle, (top + bottom) / 2, 2.0 * self._across * extent.half / ahead, bottom - top)
