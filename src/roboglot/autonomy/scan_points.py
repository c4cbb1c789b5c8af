"""A laser scan as points in base_link, with the trigonometry done once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Point, Pose
from roboglot.model.sensing import LaserScan

RAYS_MAX = 8192
FREE_WITHOUT_ECHO = 4.0  # m that a ray without an echo is taken to be free
CARRIED_NEAR = 0.09  # m around what is carried, whose echoes say nothing of the world
ECHO_SHARE_MIN = 0.1  # fewer echoes than this and the lidar is not believed at all


@dataclass(frozen=True, slots=True)
class ScanPoints:
    """``ends`` (n, 2) of the rays in base_link (m), ``hit`` 1 where there was an echo, ``points``: the echoes alone."""

    ends: NDArray[np.float64]
    hit: NDArray[np.uint8]
    points: NDArray[np.float64]
    sensor: Point

    def in_frame(self, pose: Pose, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """``points`` (n, 2; base_link) as seen from the frame in which base_link is at ``pose``."""
        c, s = np.cos(pose.yaw), np.sin(pose.yaw)
        turned: NDArray[np.float64] = points @ np.array([[c, s], [-s, c]])
        turned += (pose.x, pose.y)
        return turned

    def near(self, reach: float) -> ScanPoints:
        """The same with rays cut at ``reach`` m, where they hit nothing then."""
        away = np.hypot(self.ends[:, 0], self.ends[:, 1])
        far = away > reach
        if not far.any():
            return self
        ends, hit = self.ends * np.minimum(1.0, reach / np.maximum(away, reach))[:, None], self.hit.copy()
        hit[far] = 0
        return ScanPoints(ends, hit, self.points, self.sensor)

    def thinned(self, most: int) -> ScanPoints:
        """The same with at most so many rays, evenly chosen."""
        step = -(-len(self.ends) // most)
        if step <= 1:
            return self
        ends, hit = np.ascontiguousarray(self.ends[::step]), np.ascontiguousarray(self.hit[::step])
        return ScanPoints(ends, hit, np.ascontiguousarray(ends[hit > 0]), self.sensor)


class ScanReader:
    """Turns scans of one lidar into points."""

    def __init__(self) -> None:
        self._last: tuple[LaserScan, ScanPoints] | None = None
        self._key: object = None
        self.carried: NDArray[np.float64] | None = None  # (n, 2) what the robot carries around itself, base_link, m
        self._directions: NDArray[np.float64] = np.empty((0, 2))

    def read(self, scan: LaserScan) -> ScanPoints:
        """The scan's points, computed once for all who ask; none if hardly a ray came back."""
        if self._last is None or self._last[0] is not scan:
            self._last = scan, self._compute(scan)
        return self._last[1]

    def _compute(self, scan: LaserScan) -> ScanPoints:
        ranges = scan.ranges[:RAYS_MAX].astype(np.float64)
        key = (len(ranges), scan.angle_min, scan.angle_increment, scan.mount)
        if key != self._key:
            angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges)) + scan.mount.yaw
            self._key, self._directions = key, np.stack([np.cos(angles), np.sin(angles)], axis=1)
        with np.errstate(invalid="ignore"):
            hit = (ranges >= scan.range_min) & (ranges <= scan.range_max)
            empty = ranges > scan.range_max
        sensor = scan.mount.point
        if hit.sum() < ECHO_SHARE_MIN * len(ranges):
            none = np.empty((0, 2))
            return ScanPoints(none, np.empty(0, np.uint8), none, sensor)
        ranges[empty] = min(FREE_WITHOUT_ECHO, scan.range_max)
        ends = self._directions * ranges[:, None]
        ends += (sensor.x, sensor.y)
        if self.carried is not None and len(self.carried):
            mine = hit & (np.hypot(*(ends[:, None] - self.carried).T).min(axis=0) < CARRIED_NEAR)
            hit, empty = hit & ~mine, empty & ~mine
        points = ends[hit]
        kept = hit | empty
        if not kept.all():
            ends, hit = ends[kept], hit[kept]
        return ScanPoints(ends, hit.astype(np.uint8), points, sensor)
