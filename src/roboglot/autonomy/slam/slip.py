"""Detects slipping wheels by two scans: ranges that should change stay, at an obstacle close by.

Needed where matches cannot detect it: in a corridor, pressed against an obstacle that hides its end.
"""

from __future__ import annotations

import math

import numpy as np

from roboglot.autonomy.slam.belief import Belief
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.sensing import LaserScan

BASELINE = 0.12  # m by odometry between the two scans
TURN_MAX = math.radians(2.0)  # with more turning between them the check is skipped
CHANGE_MIN = 0.06  # m by which a range would have to change to count
STAYED = 0.3  # of that change or less: the range stayed
RAYS_MIN, SHARE_MIN = 8, 0.8  # rays that count; share of them whose range stayed
CONTACT = 0.2  # m beyond the hull within which an obstacle must stand to hold the robot
AHEAD = math.radians(50.0)  # from the direction of motion
NEIGHBOURS = 0.3  # m between echoes that lie on one surface
STEEP = 0.3  # cosine between ray and surface below which a range is ignored


class SlipWatch:
    """Watch over every scan with odometry's pose; ``radius`` of the hull, m."""

    def __init__(self, radius: float) -> None:
        self._radius = radius
        self._scan: LaserScan | None = None
        self._odometry = self._pose = Pose()
        self.slips = False

    def forget(self) -> None:
        """Forget the older scan, whose pose is in the frame of another map."""
        self._scan, self.slips = None, False

    def holds(self, belief: Belief, scan: LaserScan, odometry: Pose, last: Pose) -> bool:
        """Return whether the wheels slip; then keep the place believed at the ``last`` odometry."""
        stayed = self.check(scan, odometry, belief.map_to_odom.compose(odometry))
        if self.slips and belief.localizing:
            belief.move_to(stayed or belief.map_to_odom.compose(last), odometry)
        return self.slips and belief.localizing

    def check(self, scan: LaserScan, odometry: Pose, pose: Pose) -> Pose | None:
        """Return the pose of an older scan, where the robot has stayed, when slip begins; else None."""
        before, moved = self._scan, odometry.relative_to(self._odometry)
        if before is None or len(before.ranges) != len(scan.ranges) or abs(moved.yaw) > TURN_MAX:
            self._begin(scan, odometry, pose)
            self.slips = False
            return None
        if math.hypot(moved.x, moved.y) < BASELINE:
            return None
        stayed_at = self._pose
        slipped, self.slips = self.slips, self._stays(before, scan, moved)
        self._begin(scan, odometry, stayed_at if self.slips else pose)
        return stayed_at if self.slips and not slipped else None

    def _begin(self, scan: LaserScan, odometry: Pose, pose: Pose) -> None:
        self._scan, self._odometry, self._pose = scan, odometry, pose

    def _stays(self, before: LaserScan, now: LaserScan, moved: Pose) -> bool:
        """Return whether the ranges that ``moved`` (base_link) would change stayed."""
        reach = self._radius + CONTACT + math.hypot(before.mount.x, before.mount.y)
        if not (before.ranges < reach).any():
            return False
        angles = before.angles + before.mount.yaw
        old, new = before.ranges.astype(np.float64), now.ranges.astype(np.float64)
        rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            ends = rays * old[:, None]
            along = np.roll(ends, -1, axis=0) - np.roll(ends, 1, axis=0)
            length = np.hypot(along[:, 0], along[:, 1])
            normal = np.stack([-along[:, 1], along[:, 0]], axis=1) / length[:, None]
            facing = (normal * rays).sum(axis=1)
            change = -(normal @ (moved.x, moved.y)) / facing
            counts = (length < NEIGHBOURS) & (np.abs(facing) > STEEP) & (np.abs(change) > CHANGE_MIN)
            stayed = counts & (np.abs(new - old) < STAYED * np.abs(change))
        if counts.sum() < RAYS_MIN or stayed.sum() < SHARE_MIN * counts.sum():
            return False
        heading = math.atan2(moved.y, moved.x)
        ahead = np.array([abs(wrap_angle(angle - heading)) < AHEAD for angle in angles[stayed].tolist()])
        return bool((old[stayed][ahead] < reach).any())
