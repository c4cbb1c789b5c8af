"""Further scans to confirm a found place, or to decide between similar ones.

A newer scan must confirm a single place, as the robot may be carried on during the search. Of several places, those are
kept that still fit after a short drive: turning would not change the view of an all-round lidar, so the robot drives to
where the scan shows room. Needs the kernels.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.matcher import FREE, PLACE_AGREEMENT, PLACES_MAX, WIDE, Match, fit, search
from roboglot.autonomy.slam.scan_points import ScanPoints, ScanReader, sees
from roboglot.autonomy.slam.slam import Slam
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.clock import Clock
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import ORIGIN, Pose, wrap_angle
from roboglot.model.robot import Robot
from roboglot.model.sensing import LaserScan
from roboglot.values import dataclass

DIRECTIONS = 24  # tried
BESIDE, BEFORE, STOP_BEFORE = 0.08, 0.2, 0.12  # m beside and before the hull that stay free
STEP_MIN, STEP_MAX = 0.3, 1.0  # m per step
PERIOD = 0.1  # s between two checks ahead
SPEED = 0.25  # m/s
AHEAD = math.radians(120.0)  # directions behind are taken only if nothing else is open
SAME, SAME_YAW = 0.25, math.radians(8.0)  # difference between the place expected by odometry and the place found
SETTLE_SECONDS = 5.0  # for newer scans to agree
LISTEN_PERIOD = 0.05  # s between two checks for a newer scan
SETTLED, SETTLED_YAW = 0.02, math.radians(1.0)  # m, rad between two scans of a robot standing where it was found


async def settle(clock: Clock, estimator: Slam, belief: Belief) -> bool:
    """Follow newer scans around the found place until one confirms it; return False if they do not fit there."""
    end, seen = clock.time() + SETTLE_SECONDS, estimator.newest
    while clock.time() < end:
        await clock.sleep(LISTEN_PERIOD)
        newest = estimator.newest
        if newest is None or newest is seen:
            continue
        seen, expected = newest, belief.map_to_odom.compose(newest.odometry)
        found = _matched(belief, newest)
        if found is None:
            return False
        estimator.believe(found, newest.odometry)
        off, turned = found.pose.distance_to(expected), abs(wrap_angle(found.pose.yaw - expected.yaw))
        if off < SETTLED and turned < SETTLED_YAW:
            return True
    return False


def _matched(belief: Belief, newest: ScanTaken) -> Match | None:
    """Return the scan's match around the believed pose; None if it does not fit."""
    scan, expected = belief.reader.read(newest.scan), belief.map_to_odom.compose(newest.odometry)
    start = search(belief.map, scan, expected, WIDE)
    found = max((fit(belief.map, scan, pose, FREE) for pose in (expected, start)), key=lambda match: match.fit)
    return found if found.agreement >= PLACE_AGREEMENT else None


@dataclass(slots=True)
class Hypotheses:
    """Places that explain every scan so far, at ``odometry``; none before the first scan."""

    places: Sequence[Match] = ()
    odometry: Pose = ORIGIN
    complete: bool = False  # whether all candidates are in the list

    def narrow(self, found: Sequence[Match], odometry: Pose) -> Match | None:
        """Keep the places that are in ``found``, too; return the place if only one is left, else None."""
        step = odometry.relative_to(self.odometry)
        expected = [place.pose.compose(step) for place in self.places]
        left = [match for match in found if any(match.pose.is_near(pose, SAME, SAME_YAW) for pose in expected)]
        known, self.odometry = self.complete, odometry
        if not known or not left:  # the first scan, or all candidates were wrong
            left, known = list(found), False
        self.places, self.complete = left, known or 0 < len(found) < PLACES_MAX
        return left[0] if len(left) == 1 and (known or len(found) == 1) else None


async def go_on(robot: Robot, reader: ScanReader, source: str) -> bool:
    """Drive to where the newest scan shows room; return False if there is none, or the robot cannot drive there."""
    scan, radius = robot[Lidar].scan, robot.description.radius
    if Driving not in robot or scan is None or (DockContact in robot and robot[DockContact].docked):
        return False
    way = open_way(reader.read(scan), radius)
    if way is None or not sees(scan, way.yaw):
        return False
    turn = robot[Driving].move_by(Pose(yaw=way.yaw), source=source)
    if not await _watched(robot, turn, lambda _: True):
        return False
    move = robot[Driving].move_by(Pose(way.x), speed=SPEED, source=source)
    return await _watched(
        robot, move, lambda seen: sees(seen, 0.0) and room(reader.read(seen), 0.0, radius) > STOP_BEFORE
    )


async def _watched(robot: Robot, move: Action, goes: Callable[[LaserScan], bool]) -> bool:
    """Wait for ``move``, and cancel it if a scan does not pass ``goes``; return whether it succeeded."""
    try:
        while not move.status.ended:
            await robot.clock.sleep(PERIOD)
            scan = robot[Lidar].scan
            if scan is None or not goes(scan):
                move.cancel("something is in the way")
                break
    finally:
        if not move.status.ended:
            move.cancel("the search has ended")
    await move.done()
    return move.status is ActionStatus.SUCCEEDED


def room(scan: ScanPoints, yaw: float, radius: float) -> float:
    """Return the free distance (m) of the hull towards ``yaw`` (base_link) by ``scan``; inf: no obstacle."""
    along = scan.points @ np.array([math.cos(yaw), math.sin(yaw)])
    aside = np.abs(scan.points @ np.array([-math.sin(yaw), math.cos(yaw)]))
    ahead = along[(aside < radius + BESIDE) & (along > 0.0)]
    return float(ahead.min()) - radius if len(ahead) else math.inf


def open_way(scan: ScanPoints, radius: float) -> Pose | None:
    """Return the longest free way by ``scan`` as a turn (yaw) and a distance (x), preferably ahead; None: none."""
    best, way = 0.0, None
    for number in range(DIRECTIONS):
        yaw = wrap_angle(math.tau * number / DIRECTIONS)
        free = min(STEP_MAX, room(scan, yaw, radius) - BEFORE)
        worth = free * (1.0 if abs(yaw) <= AHEAD else 0.5) - 0.01 * abs(yaw)
        if free >= STEP_MIN and worth > best:
            best, way = worth, Pose(free, 0.0, yaw)
    return way
