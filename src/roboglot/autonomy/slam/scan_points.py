"""A laser scan as points in base_link, with the trigonometry done once."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.geometry import STILL, Point, Pose, Twist
from roboglot.model.sensing import LaserScan
from roboglot.values import dataclass

Floats = NDArray[np.float64]
RAYS_MAX = 8192
NEARBY = 12.0  # m
DESKEW_FROM = 0.01  # m or rad of motion during one turn of the lidar from which rays are corrected
CARRIED_NEAR = 0.09  # m around the load within which echoes are ignored
FACING = 0.707  # cosine of 45 degrees
ECHO_SHARE_MIN = 0.1  # share of echoes below which the scan is ignored


@dataclass(frozen=True, slots=True)
class ScanPoints:
    """``ends`` (n, 2) of the rays in base_link (m), ``hit``: 1 for those with an echo, ``points``: the echoes alone.

    Rays without an echo end at the scan's ``clear_range``.
    """

    ends: Floats
    hit: NDArray[np.uint8]
    points: Floats
    sensor: Point

    def in_frame(self, pose: Pose, points: Floats) -> Floats:
        """Return ``points`` (n, 2; base_link) in the frame in which base_link is at ``pose``."""
        c, s = np.cos(pose.yaw), np.sin(pose.yaw)
        turned: Floats = points @ np.array([[c, s], [-s, c]])
        turned += (pose.x, pose.y)
        return turned

    def beside(self, pose: Pose, discs: Sequence[tuple[float, float, float]]) -> ScanPoints:
        """Return the scan without the rays that end in ``discs`` (x, y, radius; m), in the frame of ``pose``."""
        if not discs or not len(self.ends):
            return self
        from roboglot.kernels.occupancy import outside  # it needs Numba

        kept = outside(self.ends, pose.x, pose.y, pose.yaw, np.array(discs))
        if kept.all():
            return self
        ends, hit = np.ascontiguousarray(self.ends[kept]), np.ascontiguousarray(self.hit[kept])
        return ScanPoints(ends, hit, np.ascontiguousarray(ends[hit > 0]), self.sensor)

    def nearby(self, most: int) -> Floats:
        """Return at most ``most`` of the points within NEARBY m, evenly chosen (n, 2; base_link)."""
        near = self.points[np.hypot(self.points[:, 0], self.points[:, 1]) < NEARBY]
        return np.ascontiguousarray(near[:: max(1, -(-len(near) // most))])

    def thinned(self, most: int) -> ScanPoints:
        """Return the scan with at most ``most`` rays, evenly chosen."""
        step = -(-len(self.ends) // most)
        if step <= 1:
            return self
        ends, hit = np.ascontiguousarray(self.ends[::step]), np.ascontiguousarray(self.hit[::step])
        return ScanPoints(ends, hit, np.ascontiguousarray(ends[hit > 0]), self.sensor)


class ScanReader:
    """Turns scans of one lidar into points."""

    def __init__(self, odometry: Odometry | None = None) -> None:
        self._odometry = odometry  # gives the robot's motion while the lidar turns
        self._last: tuple[LaserScan, ScanPoints] | None = None
        self._key: object = None
        self.carried: Floats | None = None  # (n, 2): the legs of the load around the robot, base_link, m
        self._directions = (np.empty(0), np.empty(0))  # x and y components of each ray
        self._rays_of: Callable[..., tuple[Floats, NDArray[np.uint8], Floats]] | None = None

    def load_kernel(self) -> None:
        """Use the compiled kernel from now on: identical results in a fifth of the time."""
        from roboglot.kernels.occupancy import rays_of

        self._rays_of = rays_of

    def read(self, scan: LaserScan) -> ScanPoints:
        """Return the scan's points, computed once; empty if almost no ray has an echo."""
        if self._last is None or self._last[0] is not scan:
            self._last = scan, self._compute(scan)
        return self._last[1]

    def _compute(self, scan: LaserScan) -> ScanPoints:
        ranges = scan.ranges[:RAYS_MAX].astype(np.float64)
        key = (len(ranges), scan.angle_min, scan.angle_increment, scan.mount)
        if key != self._key:
            angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges)) + scan.mount.yaw
            self._key, self._directions = key, (np.cos(angles), np.sin(angles))
        sensor, clear = scan.mount.point, min(scan.clear_range, scan.range_max)
        seconds = scan.time_increment * len(ranges)
        if self._rays_of and not seconds and (self.carried is None or not len(self.carried)):
            limits = scan.range_min, scan.range_max, clear
            rays = self._rays_of(ranges, *self._directions, *limits, sensor.x, sensor.y, ECHO_SHARE_MIN)
            return ScanPoints(*rays, sensor)
        with np.errstate(invalid="ignore"):
            hit = (ranges >= scan.range_min) & (ranges <= scan.range_max)
            empty = ranges > scan.range_max
        if np.count_nonzero(hit) < ECHO_SHARE_MIN * len(ranges):
            none = np.empty((0, 2))
            return ScanPoints(none, np.empty(0, np.uint8), none, sensor)
        np.putmask(ranges, empty, clear)
        ends = np.empty((len(ranges), 2))
        for axis, offset in enumerate((sensor.x, sensor.y)):  # many short rows are slower
            np.add(self._directions[axis] * ranges, offset, out=ends[:, axis])
        velocity = self._odometry.reading.twist if seconds and self._odometry else STILL
        if max(velocity.speed, abs(velocity.yaw)) * seconds > DESKEW_FROM:
            ends = _deskewed(ends, velocity, scan.time_increment)
        if self.carried is not None and len(self.carried):
            mine = hit & (np.hypot(*(ends[:, None] - self.carried).T).min(axis=0) < CARRIED_NEAR)
            hit, empty = hit & ~mine, empty & ~mine
        points = ends.take(np.flatnonzero(hit), axis=0)
        kept = hit | empty
        if np.count_nonzero(kept) < len(kept):
            ends, hit = ends[kept], hit[kept]
        return ScanPoints(ends, hit.astype(np.uint8), points, sensor)


def is_covered(ranges: NDArray[np.float32]) -> bool:
    """Return whether nearly all rays are NaN."""
    return bool(np.count_nonzero(np.isnan(ranges)) > (1.0 - ECHO_SHARE_MIN) * len(ranges))


def _deskewed(ends: Floats, velocity: Twist, increment: float) -> Floats:
    """Return ``ends`` (n, 2), taken ``increment`` s apart, in base_link at the time of the first."""
    seconds = increment * np.arange(len(ends))
    yaw = velocity.yaw * seconds
    c, s = np.cos(yaw), np.sin(yaw)
    half_c, half_s = np.cos(yaw / 2), np.sin(yaw / 2)
    moved_x = (half_c * velocity.x - half_s * velocity.y) * seconds
    moved_y = (half_s * velocity.x + half_c * velocity.y) * seconds
    x, y = ends[:, 0], ends[:, 1]
    return np.stack([c * x - s * y + moved_x, s * x + c * y + moved_y], axis=1)


def sees(scan: LaserScan | None, yaw: float) -> bool:
    """Return whether rays within 45 degrees of ``yaw`` (base_link, rad) measure anything: unknown is not free."""
    if scan is None:
        return False
    return not is_covered(scan.ranges[np.cos(scan.angles + (scan.mount.yaw - yaw)) > FACING])
