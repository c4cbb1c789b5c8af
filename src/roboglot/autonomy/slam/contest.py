"""Odometry against the scan, where they contradict: in a crowd that moves along, most points say that the robot stands.

A world that stands still speaks with one voice. Where the points that tell both poses apart do not, some of them lie on
things that move, and the wheels are believed. Robots that drive ahead drag matches back by millimetres a step, which no
single step shows: hence the way of the last second is judged too. Needs the kernels.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.slam.matcher import Match, fit
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.kernels.matching import gaps
from roboglot.model.geometry import Pose

CONTRADICTION = 0.015  # m between both poses from which they are compared
ALONG, STILL = 0.05, 0.004  # m per m driven, m: the error of wheels without slip in one step
POINTS_MAX = 300
TELLING, GAP_MIN, GAP_MAX = 0.3, 0.01, 0.2  # share of the contradiction, m, by which a point must prefer a pose; cap
MAD, NOISES = 1.48, 1.5  # standard deviation from a median; the number of them that a contradiction needs
FITS = 0.04  # m from a surface within which a point votes
ONE_VOICE = 0.9  # share of the votes that the scan's pose needs
VOTES_MIN = 4  # votes for odometry below which it is ignored
WAY_MAX, TURN_MAX = 0.3, 0.3  # m, rad: longer steps of odometry are no evidence against a scan
PAST = 1.0  # s of history over which odometry is compared again
PAST_TURN_MAX = 2.0  # rad turned within it, at most


class WheelWitness:
    """Asks the wheels about every match: over the newest step, and over the last second."""

    def __init__(self) -> None:
        # stamp, base_link by odometry alone, its believed pose (map), m driven
        self._past: deque[tuple[float, Pose, Pose, float]] = deque()
        self._wheels = Pose()

    def forget(self) -> None:
        """The pose was set, or is in doubt: the wheels know nothing of that."""
        self._past.clear()

    def note(self, stamp: float, pose: Pose, way: float) -> None:
        """The robot is believed to have been at ``pose`` (map), after ``way`` m."""
        while self._past and stamp - self._past[0][0] > PAST:
            self._past.popleft()
        self._past.append((stamp, self._wheels, pose, way))

    def contest(
        self, grid: EvidenceGrid, scan: ScanPoints, before: Pose, best: Match, prior: NDArray[np.float64], step: Pose
    ) -> Match | None:
        """Return the pose by the wheels, if they are believed rather than the ``best`` match; else None.

        Odometry says ``before`` (``prior``: its covariance) after the newest ``step`` (base_link before it).
        """
        way = math.hypot(step.x, step.y)
        if way > WAY_MAX or abs(step.yaw) > TURN_MAX:
            self.forget()
            return None
        driven = contested(grid, scan, before, best, prior, way)
        if not self._past:
            return driven
        self._wheels = self._wheels.compose(before.relative_to(self._past[-1][2]))
        _, wheels, pose, way_then = self._past[0]
        moved = self._wheels.relative_to(wheels)
        if driven is not None or abs(moved.yaw) > PAST_TURN_MAX:
            return driven
        by_wheels = pose.compose(moved)
        far = Pose(by_wheels.x, by_wheels.y, before.yaw)
        return contested(grid, scan, far, best, prior, self._past[-1][3] - way_then + way)


def contested(
    grid: EvidenceGrid, scan: ScanPoints, before: Pose, best: Match, prior: NDArray[np.float64], way: float
) -> Match | None:
    """Return the pose by odometry, if the scan's points do not clearly speak for the ``best`` match; else None.

    Odometry says ``before`` (``prior``: its covariance) after ``way`` m.
    """
    if best.pose.distance_to(before) < CONTRADICTION:
        return None
    tight = prior.copy()
    tight[:2, :] = tight[:, :2] = 0.0
    tight[0, 0] = tight[1, 1] = (STILL + ALONG * way) ** 2
    driven = fit(grid, scan, before, tight)
    apart = driven.pose.distance_to(best.pose)
    if apart < CONTRADICTION:
        return None
    points = np.ascontiguousarray(scan.points[:: math.ceil(len(scan.points) / POINTS_MAX)])
    off_wheels, off_scan = _off(grid, scan, points, driven.pose), _off(grid, scan, points, best.pose)
    if apart < NOISES * MAD * float(np.median(off_scan)):  # within the lidar's noise
        return None
    least = max(GAP_MIN, TELLING * apart)
    for_wheels = int(((off_scan - off_wheels > least) & (off_wheels < FITS)).sum())
    for_scan = int(((off_wheels - off_scan > least) & (off_scan < FITS)).sum())
    if for_wheels < VOTES_MIN or for_scan >= ONE_VOICE * (for_scan + for_wheels):
        return None
    return driven


def _off(grid: EvidenceGrid, scan: ScanPoints, points: NDArray[np.float64], pose: Pose) -> NDArray[np.float64]:
    """Return each point's distance (m) from the map's surfaces with base_link at ``pose``."""
    corner, sensor = grid.corner, np.array((scan.sensor.x, scan.sensor.y))
    x, y = pose.x - corner.x, pose.y - corner.y
    off: NDArray[np.float64] = gaps(grid.surface, grid.evidence, points, x, y, pose.yaw, sensor, RESOLUTION)[:, 0]
    return np.minimum(off, GAP_MAX)
