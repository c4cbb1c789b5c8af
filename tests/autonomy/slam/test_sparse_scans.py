"""Scans that lie over a metre and up to a quarter turn apart, with bad wheels between them, become a map."""

from __future__ import annotations

import math
import random
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from roboglot.autonomy.slam.replaying import map_recording
from roboglot.datasets.drive_log import DriveLog, RecordedScan
from roboglot.datasets.measures import absolute_error
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.sensing import LaserScan

LENGTH, DEPTH, WIDTH = 24.0, 14.0, 3.0  # m: a corridor around a block
STEP = 1.2  # m between two scans
SLIP = 0.3  # standard deviation of the logarithm of what the wheels report for a metre
NOISE = 0.01  # m
SEEDS = (4, 5, 7)
ANGLES = np.radians(np.arange(-90.0, 90.1, 0.5))


def walls(dice: random.Random) -> NDArray[np.float64]:
    """Return segments (n, 4): both sides of the corridor, with doors set back into them."""
    found = []
    for x0, y0, x1, y1, side in (
        (0, 0, LENGTH, 0, -1), (LENGTH, 0, LENGTH, DEPTH, -1), (LENGTH, DEPTH, 0, DEPTH, -1), (0, DEPTH, 0, 0, -1),
        (WIDTH, WIDTH, LENGTH - WIDTH, WIDTH, 1), (LENGTH - WIDTH, WIDTH, LENGTH - WIDTH, DEPTH - WIDTH, 1),
        (LENGTH - WIDTH, DEPTH - WIDTH, WIDTH, DEPTH - WIDTH, 1), (WIDTH, DEPTH - WIDTH, WIDTH, WIDTH, 1),
    ):  # fmt: skip
        long = math.hypot(x1 - x0, y1 - y0)
        c, s = (x1 - x0) / long, (y1 - y0) / long
        line, at = [(0.0, 0.0)], 0.0
        while (at := at + dice.uniform(1.5, 4.0)) < long - 1.5:
            line += [(at, 0.0), (at, 0.2 * side), (at + 0.9, 0.2 * side), (at + 0.9, 0.0)]
            at += 0.9
        corners = [(x0 + c * a - s * b, y0 + s * a + c * b) for a, b in [*line, (long, 0.0)]]
        found += [(*one, *other) for one, other in pairwise(corners)]
    return np.array(found)


def ranges(pose: Pose, segments: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance of the first wall along each ray, m."""
    dx, dy = np.cos(pose.yaw + ANGLES)[:, None], np.sin(pose.yaw + ANGLES)[:, None]
    x, y, ex, ey = segments[:, 0] - pose.x, segments[:, 1] - pose.y, *(segments[:, 2:] - segments[:, :2]).T
    cross = dx * ey - dy * ex
    with np.errstate(divide="ignore", invalid="ignore"):
        along, beside = (x * ey - y * ex) / cross, (x * dy - y * dx) / cross
    nearest: NDArray[np.float64] = np.where((along > 0) & (beside >= 0) & (beside <= 1), along, np.inf).min(axis=1)
    return nearest


def drive(dice: random.Random) -> DriveLog:
    """Return a round through the corridor, with references."""
    segments, scans = walls(dice), list[RecordedScan]()
    corners = [(1.0, 1.0), (LENGTH - 1, 1.0), (LENGTH - 1, DEPTH - 1), (1.0, DEPTH - 1), (1.0, 1.0)]
    places = []
    for (x, y), (to_x, to_y) in pairwise(corners):
        yaw, way = math.atan2(to_y - y, to_x - x), math.hypot(to_x - x, to_y - y)
        count = int(way / STEP)
        places += [
            Pose(x + way * n / count * math.cos(yaw) + dice.gauss(0, 0.1), y + way * n / count * math.sin(yaw), yaw)
            for n in range(count)
        ]
    odometry, last, wheels = Pose(), places[0], random.Random(dice.random())
    for number, place in enumerate(places):
        step = place.relative_to(last)
        odometry = odometry.compose(
            Pose(step.x * math.exp(wheels.gauss(0.0, SLIP)), step.y, wrap_angle(step.yaw + dice.gauss(0.0, 0.03)))
        )
        seen = ranges(place, segments) + np.array([dice.gauss(0.0, NOISE) for _ in ANGLES])
        scan = LaserScan(
            stamp=1.5 * number, angle_min=float(ANGLES[0]), angle_increment=float(ANGLES[1] - ANGLES[0]), range_min=0.1,
            range_max=80.0, ranges=seen.astype(np.float32),
        )  # fmt: skip
        scans.append(RecordedScan(scan, odometry, place))
        last = place
    return DriveLog("round", scans, {})


@pytest.mark.slow  # in short: test_gyro_drift_and_wrong_wheels_are_learnt_fast
@pytest.mark.parametrize("seed", [SEEDS[0], *(pytest.param(seed, marks=pytest.mark.slow) for seed in SEEDS[1:])])
def test_bad_wheels_are_believed_less(seed: int) -> None:
    log = drive(random.Random(seed))
    mapped = map_recording(log)
    truth = {item.scan.stamp: item.reference for item in log.scans if item.reference is not None}
    pairs = [(point.pose, truth[point.stamp]) for point in mapped.trajectory]
    assert absolute_error([pose for pose, _ in pairs], [place for _, place in pairs]) < 0.03
    assert mapped.noise[0] > 3.0  # of the way, as a multiple of what is assumed
