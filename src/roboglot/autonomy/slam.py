"""The estimator behind localization and mapping: matches every scan to the map, then adds it to the map.

Needs the kernels, hence is imported only when they are loaded. Uses nothing but scans and odometry.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.belief import SURE, Belief
from roboglot.autonomy.evidence import RESOLUTION
from roboglot.autonomy.scan_points import ScanPoints, ScanReader
from roboglot.kernels.matching import match
from roboglot.kernels.occupancy import integrate
from roboglot.kernels.relocation import correlate, likelihood_field
from roboglot.model.events import PoseJumped, ScanTaken
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.robot import Robot

ITERATIONS_MAX = 8
POINTS_MIN = 15  # that must fit before a match is believed
AGREEMENT_MIN = 0.5  # share of the points on known ground that must fit before the pose is corrected
AGREEMENT_TO_MAP = 0.6  # … before the scan is added to the map
KNOWN_SHARE = 0.4  # of all points; when fewer lie on known ground, quality suffers
QUALITY_GAIN = 0.3  # weight of the newest scan in the quality
# Odometry noise: standard deviations per metre and rad between two scans, and when standing.
NOISE_STILL, NOISE_PER_METRE = 0.001, 0.1
YAW_NOISE_STILL, YAW_NOISE_PER_RAD, YAW_NOISE_PER_METRE = 0.0005, 0.05, 0.02
STILL, STILL_YAW = 0.002, math.radians(0.1)  # less than this between scans is standing
STILL_PERIOD = 0.5  # s between two matches while standing
ADD_AFTER, ADD_AFTER_YAW, ADD_PERIOD = 0.05, math.radians(3.0), 1.0  # m, rad, s between scans added to the map
LOST_QUALITY, LOST_PERIOD = 0.4, 1.0  # below this it looks around, once in so many seconds
SEARCH_REACH, SEARCH_TURN, SEARCH_STEP = 0.5, math.radians(20.0), math.radians(1.0)
SEARCH_POINTS_MAX = 90
SEARCH_RANGE_MAX = 12.0  # m
JUMP, JUMP_YAW = 0.2, math.radians(10.0)  # corrections beyond this are told as a jump


class Slam:
    """Listens to the lidar from ``start`` to ``close``."""

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot = robot
        self._belief = belief
        self._reader = ScanReader()
        self._matched_odometry: Pose | None = None
        self._matched_at = self._added_at = self._searched_at = -math.inf
        self._added: Pose | None = None
        self._agreement = 1.0
        self._stop = robot.events.listen(ScanTaken, self._take)

    def close(self) -> None:
        """Stop listening."""
        self._stop()

    def _take(self, event: ScanTaken) -> None:
        belief, odometry = self._belief, event.odometry
        last = self._matched_odometry or odometry
        way, turn = odometry.distance_to(last), abs(wrap_angle(odometry.yaw - last.yaw))
        if way < STILL and turn < STILL_YAW and event.stamp - self._matched_at < STILL_PERIOD and not belief.search:
            return
        scan = self._reader.read(event.scan)
        if len(scan.points) < POINTS_MIN:
            belief.quality *= 1.0 - QUALITY_GAIN
            return
        self._matched_odometry, self._matched_at = odometry, event.stamp
        self._spread(way, turn)
        if belief.map.scans:
            self._correct(scan, odometry, event.stamp)
        else:
            belief.quality = self._agreement = 1.0  # the first scan defines the map
        if belief.mapping and self._is_due(belief.map_to_odom.compose(odometry), event.stamp):
            self._add(scan, belief.map_to_odom.compose(odometry), event.stamp)

    def _spread(self, way: float, turn: float) -> None:
        """Odometry made the belief wider."""
        along = (NOISE_STILL + NOISE_PER_METRE * way) ** 2
        around = (YAW_NOISE_STILL + YAW_NOISE_PER_RAD * turn + YAW_NOISE_PER_METRE * way) ** 2
        self._belief.covariance = self._belief.covariance + np.diag((along, along, around))

    def _correct(self, scan: ScanPoints, odometry: Pose, stamp: float) -> None:
        """Match, judge how well it fits, and move the belief if it may be moved."""
        belief = self._belief
        before = belief.map_to_odom.compose(odometry)
        pose, covariance, fit, known = self._match(scan, before, belief.covariance)
        lost = belief.quality < LOST_QUALITY and stamp - self._searched_at >= LOST_PERIOD
        if belief.localizing and (belief.search or lost):
            self._searched_at = stamp
            found = self._match(scan, self._search(scan, before), np.diag((0.05**2, 0.05**2, 0.03**2)))
            if found[2] > fit + 0.05 * len(scan.points):
                pose, covariance, fit, known = found
        share = fit / max(known, KNOWN_SHARE * len(scan.points))
        self._agreement = fit / max(known, POINTS_MIN)
        belief.quality += (1.0 if belief.search else QUALITY_GAIN) * (min(1.0, share) - belief.quality)
        belief.search = False
        if not belief.localizing or fit < POINTS_MIN or self._agreement < AGREEMENT_MIN:
            return
        belief.covariance = covariance
        belief.move_to(pose, odometry)
        if pose.distance_to(before) > JUMP or abs(wrap_angle(pose.yaw - before.yaw)) > JUMP_YAW:
            self._robot.events.publish(PoseJumped(stamp=stamp, pose=pose))

    def _match(
        self, scan: ScanPoints, prior: Pose, covariance: NDArray[np.float64]
    ) -> tuple[Pose, NDArray[np.float64], int, int]:
        """The best pose near ``prior``, its covariance, how many points fit, how many lie on known ground."""
        grid = self._belief.map
        corner = grid.corner
        information = np.linalg.inv(covariance)
        start = np.array((prior.x - corner.x, prior.y - corner.y, prior.yaw))
        sensor = np.array((scan.sensor.x, scan.sensor.y))
        iterations = ITERATIONS_MAX if self._belief.localizing else 0
        found, gained, fit, known = match(
            grid.surface, grid.evidence, scan.points, start, information, sensor, RESOLUTION, iterations
        )
        narrowed = np.linalg.inv(gained + information)
        np.fill_diagonal(narrowed, np.maximum(np.diag(narrowed), SURE))
        x, y, yaw = found.tolist()
        return Pose(x + corner.x, y + corner.y, wrap_angle(yaw)), narrowed, fit, known

    def _search(self, scan: ScanPoints, centre: Pose) -> Pose:
        """The pose within half a metre and 20 degrees at which most points lie on occupied cells."""
        grid = self._belief.map
        corner, side = grid.corner, SEARCH_RANGE_MAX + SEARCH_REACH
        row, column = ((v - c) / RESOLUTION for v, c in ((centre.y, corner.y), (centre.x, corner.x)))
        half, (height, width) = side / RESOLUTION, grid.evidence.shape
        row0, row1 = (min(max(int(row + d), 0), height) for d in (-half, half))
        col0, col1 = (min(max(int(column + d), 0), width) for d in (-half, half))
        field = likelihood_field(np.ascontiguousarray(grid.evidence[row0:row1, col0:col1]))
        near = scan.points[np.hypot(scan.points[:, 0], scan.points[:, 1]) < SEARCH_RANGE_MAX]
        points = np.ascontiguousarray(near[:: max(1, math.ceil(len(near) / SEARCH_POINTS_MAX))])
        left, bottom = corner.x + col0 * RESOLUTION, corner.y + row0 * RESOLUTION
        start = np.array((centre.x - left, centre.y - bottom, centre.yaw))
        x, y, yaw, _ = correlate(field, points, start, RESOLUTION, SEARCH_REACH, SEARCH_TURN, SEARCH_STEP)
        return Pose(x + left, y + bottom, wrap_angle(yaw))

    def _is_due(self, pose: Pose, stamp: float) -> bool:
        """Whether a scan taken at ``pose`` tells the map something new, and may."""
        if not self._belief.map.scans or self._added is None:
            return True
        if self._belief.localizing and self._agreement < AGREEMENT_TO_MAP:
            return False
        moved = (
            pose.distance_to(self._added) >= ADD_AFTER or abs(wrap_angle(pose.yaw - self._added.yaw)) >= ADD_AFTER_YAW
        )
        return moved or stamp - self._added_at >= ADD_PERIOD - 1e-6

    def _add(self, scan: ScanPoints, pose: Pose, stamp: float) -> None:
        grid = self._belief.map
        ends = scan.in_frame(pose, scan.ends)
        (min_x, min_y), (max_x, max_y) = ends.min(axis=0).tolist(), ends.max(axis=0).tolist()
        grid.make_room(min(min_x, pose.x), min(min_y, pose.y), max(max_x, pose.x), max(max_y, pose.y))
        corner, grid.scans = grid.corner, grid.scans + 1
        ends -= (corner.x, corner.y)
        sensor = pose.compose(Pose(scan.sensor.x, scan.sensor.y))
        integrate(
            grid.evidence,
            grid.surface,
            grid.marks,
            grid.scans,
            ends,
            scan.hit,
            sensor.x - corner.x,
            sensor.y - corner.y,
            RESOLUTION,
        )
        self._added, self._added_at = pose, stamp
        self._belief.revision += 1
