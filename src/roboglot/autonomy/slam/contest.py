"""Odometry against the scan, where they contradict: in a crowd that moves along, most points say that the robot stands.

A world that stands still speaks with one voice. Where the points that tell both poses apart do not, some of them lie on
things that move, and the wheels are believed. Needs the kernels.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.slam.matcher import Match, fit
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.kernels.matching import gaps
from roboglot.model.geometry import Pose

CONTRADICTION = 0.015  # m between both poses from which they are compared
ALONG, STILL = 0.05, 0.004  # m per m driven, m: what wheels that do not slip get wrong in one step
POINTS_MAX = 300
TELLING, GAP_MIN, GAP_MAX = 0.3, 0.01, 0.2  # share of the contradiction, m, by which a point fits one pose better; cap
MAD, NOISES = 1.48, 1.5  # standard deviation by a median; how many of them a contradiction must have
FITS = 0.04  # m off a surface at most of a point that speaks for a pose
ONE_VOICE = 0.9  # share of those points that must speak for the scan's pose
VOTES_MIN = 4  # points for odometry, or it has no say


def contested(
    grid: EvidenceGrid, scan: ScanPoints, before: Pose, best: Match, prior: NDArray[np.float64], way: float
) -> Match | None:
    """Where odometry puts the robot, if the scan's points do not clearly speak for the ``best`` match; else None.

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
    """How far (m) each of ``points`` lies off the map's surfaces with base_link at ``pose``."""
    corner, sensor = grid.corner, np.array((scan.sensor.x, scan.sensor.y))
    x, y = pose.x - corner.x, pose.y - corner.y
    off: NDArray[np.float64] = gaps(grid.surface, grid.evidence, points, x, y, pose.yaw, sensor, RESOLUTION)[:, 0]
    return np.minimum(off, GAP_MAX)
