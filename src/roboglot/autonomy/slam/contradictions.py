"""Decides between contradicting odometry and scan: in a crowd moving along, most points suggest that the robot stands.

In a static world, all points that distinguish both poses agree. If they disagree, some are on moving things, and the
wheels are believed: their pose, matched to walls alone. The wheels are also believed if only surfaces that were painted
a moment ago, and are not walls, support the scan's pose, unless wheels may well be as far off as that: on new floor all
surfaces are new. Robots driving ahead drag matches back by millimetres per step, too little for a single step: so the
last seconds are judged too. Needs the kernels.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.slam.matcher import MATCH_POINTS_MAX, POINTS_MIN, Match, fit
from roboglot.autonomy.slam.odometry.learner import OdometryLearner
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.autonomy.slam.walls import on_walls
from roboglot.kernels.matching import gaps
from roboglot.model.geometry import Pose
from roboglot.values import dataclass

Floats = NDArray[np.float64]
CONTRADICTION = 0.015  # m between both poses from which they are compared
ALONG, STILL = 0.05, 0.004  # m per m driven, m: the error of wheels without slip in one step
POINTS_MAX = 300
TELLING, GAP_MIN, GAP_MAX = 0.3, 0.01, 0.2  # share of the contradiction, m, by which a point must prefer a pose; cap
MAD, NOISES = 1.48, 1.5  # standard deviation from a median; the number of them that a contradiction needs
FITS = 0.04  # m from a surface within which a point votes
ONE_VOICE, STOOD_VOICE = 0.9, 0.97  # share of the votes that the scan's pose needs; of a robot that stood, far from it
FIRM = 500  # evidence from which a surface is known well: some five scans
VOTES_MIN = 4  # votes for odometry below which it is ignored, as far as the lidar's noise explains them
NOISE_MAX = 0.1  # m between both poses from which no noise makes a point prefer the wrong one
STOOD = 0.02  # m driven up to which a robot stood, and its wheels cannot be that wrong
SIGMAS = 1.0  # of odometry: smaller contradictions are its own errors
FRESH_SIGMAS = 3.0  # of odometry: new surfaces that fit the scan are no evidence against it up to there
WAY_MAX, TURN_MAX = 0.3, 0.3  # m, rad: longer steps of odometry are no evidence against a scan
PASTS = (1.0, 4.0)  # s of history over which odometry is compared again
PAST_TURN_MAX = 2.0  # rad turned within them, at most


def is_long(step: Pose) -> bool:
    """Return whether a step of odometry is too long to be compared, and for neighbours to drag its match along."""
    return math.hypot(step.x, step.y) > WAY_MAX or abs(step.yaw) > TURN_MAX


@dataclass(frozen=True, slots=True)
class Moment:
    """Pose of base_link at ``stamp``, by the ``wheels`` alone and as believed (map); sums up to that time.

    ``way``: m driven; ``variance`` of the wheels' noise, m2.
    """

    stamp: float
    wheels: Pose
    pose: Pose
    way: float
    variance: float


class WheelWitness:
    """Checks every match against the wheels, over the newest step and over the last seconds."""

    def __init__(self, odometry: OdometryLearner) -> None:
        self._odometry = odometry
        self._past: deque[Moment] = deque()
        self._wheels, self._variance = Pose(), 0.0

    def forget(self) -> None:
        """Forget the past, as the pose was set or is in doubt."""
        self._past.clear()

    def note(self, stamp: float, pose: Pose, way: float) -> None:
        """Note the believed ``pose`` (map) at ``stamp``, after ``way`` m."""
        while self._past and stamp - self._past[0].stamp > PASTS[-1]:
            self._past.popleft()
        self._variance += self._odometry.noise.newest.way
        self._past.append(Moment(stamp, self._wheels, pose, way, self._variance))

    def contest(
        self, grid: EvidenceGrid, scan: ScanPoints, before: Pose, best: Match, prior: Floats, step: Pose
    ) -> Match | None:
        """Return the pose by the wheels, if it is more credible than the ``best`` match; else None.

        ``before``: pose by odometry (``prior``: its covariance) after the newest ``step`` (in the last base_link).
        """
        if is_long(step):
            self.forget()
            return None
        way = math.hypot(step.x, step.y)
        newest = self._odometry.noise.newest.way
        driven = contested(grid, scan, before, best, prior, way, self._sigma(way, newest))
        if not self._past:
            return driven
        last = self._past[-1]
        self._wheels = self._wheels.compose(before.relative_to(last.pose))
        for seconds in PASTS:
            if driven is not None:
                break
            then = self._past[bisect_right(self._past, -seconds, key=lambda moment: moment.stamp - last.stamp)]
            moved, driven_way = self._wheels.relative_to(then.wheels), last.way - then.way + way
            if abs(moved.yaw) > PAST_TURN_MAX:
                break
            by_wheels = then.pose.compose(moved)
            far = Pose(by_wheels.x, by_wheels.y, before.yaw)
            sigma = self._sigma(driven_way, last.variance - then.variance + newest)
            driven = contested(grid, scan, far, best, prior, driven_way, sigma)
            if driven is not None and driven_way <= STOOD:
                self._forget_since(then)
        return driven

    def _forget_since(self, then: Moment) -> None:
        """Drop the poses believed after ``then``: they were wrong, and must not contradict a true one."""
        while self._past[-1] is not then:
            self._past.pop()

    def _sigma(self, way: float, variance: float) -> float:
        """Return the standard deviation (m) of the wheels after ``way`` m, with ``variance`` (m2) of noise."""
        return STILL + math.sqrt(variance) + self._odometry.bias.scale_doubt * way


def contested(
    grid: EvidenceGrid,
    scan: ScanPoints,
    before: Pose,
    best: Match,
    prior: Floats,
    way: float,
    sigma: float,
) -> Match | None:
    """Return the pose by odometry, if the scan's points do not clearly speak for the ``best`` match; else None.

    ``before``: pose by odometry (``prior``: its covariance; ``sigma``: its standard deviation, m) after ``way`` m.
    """
    contradiction = best.pose.distance_to(before)
    if contradiction < max(CONTRADICTION, SIGMAS * sigma):
        return None
    tight = prior.copy()
    tight[:2, :] = tight[:, :2] = 0.0
    tight[0, 0] = tight[1, 1] = (STILL + ALONG * way) ** 2
    driven = _by_walls(grid, scan, before, tight)
    apart = driven.pose.distance_to(best.pose)
    if apart < CONTRADICTION:
        return None
    points = np.ascontiguousarray(scan.points[:: math.ceil(len(scan.points) / POINTS_MAX)])
    off_wheels, off_scan = _off(grid, scan, points, driven.pose), _off(grid, scan, points, best.pose)
    if apart < NOISES * MAD * float(np.median(off_scan)):  # within the lidar's noise
        return None
    least = max(GAP_MIN, TELLING * apart)
    for_wheels = np.count_nonzero((off_scan - off_wheels > least) & (off_wheels < FITS))
    for_scan = np.count_nonzero(votes := (off_wheels - off_scan > least) & (off_scan < FITS))
    if for_scan and contradiction > FRESH_SIGMAS * sigma:
        fresh = _fresh(grid, scan.in_frame(best.pose, points[votes & ~on_walls(points)]))
        if way > STOOD or 2 * fresh > for_scan:  # walls show that a robot which stood was moved
            for_wheels, for_scan = for_wheels + fresh, for_scan - fresh
    jumped = apart >= NOISE_MAX and way <= STOOD
    if for_wheels < VOTES_MIN and not jumped:
        return None
    if for_scan >= (STOOD_VOICE if jumped else ONE_VOICE) * (for_scan + for_wheels):
        return None
    return driven


def _fresh(grid: EvidenceGrid, places: Floats) -> int:
    """Return how many of ``places`` (n, 2; map, m) lie on surfaces that few scans have seen.

    Such a surface that fits the scan's pose alone belongs to a thing that moves along: if it stood still, the surface
    painted a moment ago would fit the wheels.
    """
    columns, rows = np.floor((places - (grid.corner.x, grid.corner.y)) / RESOLUTION).astype(np.int64).T
    beside = [(rows + down, columns + across) for down in (-1, 0, 1) for across in (-1, 0, 1)]
    most = np.max([grid.evidence.take(row * grid.evidence.shape[1] + column, mode="clip") for row, column in beside], 0)
    return int(np.count_nonzero(most < FIRM))


def _by_walls(grid: EvidenceGrid, scan: ScanPoints, before: Pose, tight: Floats) -> Match:
    """Return the wheels' pose, corrected by walls only; the match is judged by the whole scan."""
    points = scan.points[:: math.ceil(len(scan.points) / MATCH_POINTS_MAX)]
    walls = np.ascontiguousarray(points[on_walls(points)])
    if len(walls) >= POINTS_MIN:
        before = fit(grid, replace(scan, points=walls), before, tight).pose
    return fit(grid, scan, before, tight, iterations=0)


def _off(grid: EvidenceGrid, scan: ScanPoints, points: Floats, pose: Pose) -> Floats:
    """Return each point's distance (m) from the map's surfaces with base_link at ``pose``."""
    corner, sensor = grid.corner, np.array((scan.sensor.x, scan.sensor.y))
    x, y = pose.x - corner.x, pose.y - corner.y
    off: Floats = gaps(grid.slots, grid.surfaces, grid.evidence, points, x, y, pose.yaw, sensor, RESOLUTION)[:, 0]
    return np.minimum(off, GAP_MAX)
