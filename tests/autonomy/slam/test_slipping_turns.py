"""Wheels that slip in turns, among posts that the robot sees for the first time: the scans are believed."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from numpy.typing import NDArray

from roboglot.autonomy.slam.replaying import map_recording
from roboglot.datasets.drive_log import DriveLog, RecordedScan
from roboglot.datasets.measures import absolute_error
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.sensing import LaserScan

HALF, POSTS = 9.0, 130  # m: half a side of the yard
ROUTE, ASIDE = 5.0, 0.7  # m: half a side of the square that is driven, and the free way beside it
STEP, TURN, PERIOD = 0.15, math.radians(9.0), 0.1  # m, rad, s between two scans
SLIP, WAY_SLIP = 0.6, 0.1  # standard deviations of what the wheels report too much, as a share
REACH, NOISE = 4.0, 0.01  # m
ANGLES = np.radians(np.arange(-120.0, 120.1, 0.7))


def posts(dice: random.Random) -> NDArray[np.float64]:
    """Return x, y, radius (n, 3; m) of posts beside the route."""
    found = list[tuple[float, float, float]]()
    while len(found) < POSTS:
        x, y, radius = dice.uniform(-HALF, HALF), dice.uniform(-HALF, HALF), dice.uniform(0.05, 0.25)
        if abs(max(abs(x), abs(y)) - ROUTE) >= ASIDE + radius:
            found.append((x, y, radius))
    return np.array(found)


def route(corners: int) -> list[Pose]:
    """Return the poses of the scans along a square, up to its n-th corner."""
    here, poses = Pose(-ROUTE, -ROUTE), list[Pose]()
    for corner in range(corners):
        goal_x, goal_y = ((ROUTE, -ROUTE), (ROUTE, ROUTE), (-ROUTE, ROUTE), (-ROUTE, -ROUTE))[corner % 4]
        yaw = math.atan2(goal_y - here.y, goal_x - here.x)
        turn, way = wrap_angle(yaw - here.yaw), math.hypot(goal_x - here.x, goal_y - here.y)
        turns, steps = max(1, math.ceil(abs(turn) / TURN)), math.ceil(way / STEP)
        poses += [Pose(here.x, here.y, here.yaw + turn * n / turns) for n in range(1, turns + 1)]
        for n in range(1, steps + 1):
            share = n / steps
            x, y = here.x + share * (goal_x - here.x), here.y + share * (goal_y - here.y)
            poses.append(Pose(x, y, yaw + math.radians(4.0) * math.sin(n / 3)))
        here = Pose(goal_x, goal_y, yaw)
    return poses


def ranges(pose: Pose, things: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance of the first post along each ray, m."""
    c, s = np.cos(pose.yaw + ANGLES)[:, None], np.sin(pose.yaw + ANGLES)[:, None]
    x, y, radius = things[:, 0] - pose.x, things[:, 1] - pose.y, things[:, 2]
    middle, beside = c * x + s * y, np.abs(c * y - s * x)
    front = middle - np.sqrt(np.maximum(radius**2 - beside**2, 0.0))
    nearest: NDArray[np.float64] = np.where((middle > 0) & (beside < radius), front, np.inf).min(axis=1)
    return nearest


def drive(seed: int, corners: int) -> DriveLog:
    """Return a drive with references."""
    dice, scans = random.Random(seed), list[RecordedScan]()
    things, places = posts(dice), route(corners)
    odometry, last, slip = Pose(), places[0], 0.0
    for number, place in enumerate(places):
        step, last = place.relative_to(last), place
        slip = 0.7 * slip + dice.gauss(0.0, 0.7 * SLIP)
        turned = wrap_angle(step.yaw * (1.0 + slip) + dice.gauss(0.0, 0.01))
        odometry = odometry.compose(Pose(step.x * math.exp(dice.gauss(0.0, WAY_SLIP)), step.y, turned))
        seen = ranges(place, things) + np.array([dice.gauss(0.0, NOISE) for _ in ANGLES])
        scan = LaserScan(
            stamp=PERIOD * number, angle_min=float(ANGLES[0]), angle_increment=float(ANGLES[1] - ANGLES[0]),
            range_min=0.06, range_max=REACH, ranges=np.where(seen < REACH, seen, np.inf).astype(np.float32),
        )  # fmt: skip
        scans.append(RecordedScan(scan, odometry, place))
    return DriveLog("yard", scans, {})


@pytest.mark.parametrize(("seed", "corners"), [(9, 3), pytest.param(11, 6, marks=pytest.mark.slow)])
def test_wheels_slip_in_turns_on_new_floor(seed: int, corners: int) -> None:
    """Wheels that were believed for one turn lead the next scans astray, too, until none fits the map."""
    log = drive(seed, corners)
    mapped = map_recording(log)
    truth = {recorded.scan.stamp: recorded.reference for recorded in log.scans}
    pairs = [(point.pose, place) for point in mapped.trajectory if (place := truth[point.stamp]) is not None]
    assert sum(quality < 0.5 for quality in mapped.qualities) < 0.02 * len(mapped.qualities)
    assert absolute_error([pose for pose, _ in pairs], [place for _, place in pairs]) < 0.12
