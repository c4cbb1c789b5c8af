"""Right of way where robots meet: by their announcements on a common map, else by the lidar.

A robot inside a narrow place goes first, then one of higher priority, then by name. All positions are in map, m.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.route import SPACING
from roboglot.model.components.logistics.traffic_radio import Announcement
from roboglot.model.geometry import Pose
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.autonomy.traffic.movers import Mover  # it needs the kernels

CLEAR = 0.10  # m kept between two hulls
CLEAR_MOVING = 0.06  # m kept from the place where a moving object can come to a stop
DECELERATION, REACTION = 0.6, 0.2  # m/s2 and s assumed for others
PASSED = 5  # points of an announced way among which the robot may be by now
STEP = 0.2  # m between two points of a route that are compared
SLOW = 0.4  # m/s assumed at least, to decide which robot arrives first
BEFORE, AFTER = 1.0, 2.0  # s between two arrivals, later or earlier, from which robots do not meet
LEAVES = 1.2  # m within which a path must leave another robot's route if it begins in it
ALIKE = 0.5  # cosine from which two directions count as the same
SIGHT = 2.5  # s for which an object seen by the lidar is extrapolated in a straight line
THROUGH = 6.0  # m of a narrow place that are examined along the route
OUT = 4  # points of the route added beyond it
ASIDE = 0.15  # m to its right to which an object is expected to move

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Way:
    """Next metres of another robot: ``points`` (n, 2) about STEP apart, from its place; ``radius`` of its hull."""

    points: Points
    speed: float
    radius: float
    outranks: bool  # whether it goes first by rule
    name: str = ""
    under_way: bool = False  # although it may stand at present

    @property
    def seconds(self) -> Points:
        """Times from now until the robot is at each point, s."""
        steps = np.hypot(*np.diff(self.points, axis=0, prepend=self.points[:1]).T)
        times: Points = np.cumsum(steps) / max(self.speed, SLOW)
        return times

    def distances(self, path: Points) -> Points:
        """Return the distances (m) between all points of ``path`` and all points of this way."""
        away: Points = np.hypot(*(path[:, None] - self.points[None, :]).transpose(2, 0, 1))
        return away

    def is_within(self, reach: float, pose: Pose) -> bool:
        """True if the robot is now within ``reach`` m of ``pose``."""
        x, y = self.points[0].tolist()
        return math.hypot(x - pose.x, y - pose.y) < reach


@dataclass(frozen=True, slots=True)
class Meeting:
    """Conflict of a path with ``way``: the robot must wait before ``along`` m until the other has passed."""

    along: float
    way: Way
    stands_in_it: bool  # whether the robot itself stands where the other wants to go


def rank(announcement: Announcement) -> tuple[bool, int, str]:
    """Return the rank of a robot; the smaller one goes first."""
    return not announcement.inside, -announcement.priority, announcement.robot


def announced_way(other: Announcement, mine: Announcement, *, under_way: bool = True) -> Way:
    """Return the way that another robot announced, without what it passed since it planned that."""
    away = [other.pose.distance_to(point) for point in other.way[:PASSED]]
    ahead = other.way[away.index(min(away)) + 1 :] if away else ()
    points = [(other.pose.x, other.pose.y), *((point.x, point.y) for point in ahead)]
    outranks = rank(other) < rank(mine)
    return Way(np.array(points), other.speed, other.radius, outranks, other.robot, under_way)


def expected_way(mover: Mover, *, under_way: bool) -> Way:
    """Return a mover's way, straight on."""
    speed = mover.speed
    points = straight_on(mover, speed * SIGHT + STEP if speed > 0.0 else STEP)
    return Way(points, speed, mover.radius, outranks=False, under_way=under_way)


def straight_on(mover: Mover, far: float) -> Points:
    """Return points up to ``far`` m ahead of a mover, in the direction of its last motion."""
    if far <= STEP:
        return np.array([(mover.x, mover.y)])
    away = np.arange(0.0, far, STEP)
    points = np.empty((len(away), 2))
    points[:, 0] = mover.x + away * math.cos(mover.heading)
    points[:, 1] = mover.y + away * math.sin(mover.heading)
    return points


def through_narrow(mover: Mover, points: Points, narrow: NDArray[np.bool_]) -> Way:
    """Return the way of a mover in a narrow place: along ``points`` (straight on) out of it, with right of way."""
    end = int(np.argmin([*narrow, False])) + OUT
    return Way(points[:end], mover.speed, mover.radius, outranks=True, under_way=True)


def shifted(way: Way) -> Points:
    """Return the way's points shifted to its right, so that plans pass on the other side."""
    if len(way.points) < 2:
        return way.points
    ahead = way.points[-1] - way.points[0]
    ahead /= max(float(np.hypot(*ahead)), 1e-6)
    moved: Points = way.points + ASIDE * np.array((ahead[1], -ahead[0]))
    return moved


def meetings(path: Points, speed: float, radius: float, ways: Sequence[Way]) -> Iterator[Meeting]:
    """Yield the meetings with others if the hull continues along ``path`` (dense) at ``speed`` m/s."""
    from roboglot.kernels.distance import facing  # it needs Numba

    mine = np.ascontiguousarray(path[:: round(STEP / SPACING)])
    if len(mine) < 2:
        return
    seconds = np.arange(len(mine)) * STEP / max(speed, SLOW)
    x, y = path[0].tolist()
    for way in ways:
        if len(way.points) < 2 or _is_far(way, x, y, len(path), radius + CLEAR):
            continue
        close = facing(mine, way.points, radius + way.radius + CLEAR, ALIKE)
        if not close.any():
            continue
        later = way.seconds[None, :] - seconds[:, None]
        meets = np.asarray((close & (later > -BEFORE) & (later < AFTER)).any(axis=1))
        stands = bool(close[0].any())
        if stands:  # a robot that is leaving the other's route continues
            clear = np.flatnonzero(~close.any(axis=1))
            leaves = int(clear[0]) if len(clear) else len(mine)
            if leaves * STEP <= LEAVES:
                meets[:leaves], stands = False, False
        if meets.any():
            yield Meeting(float(meets.argmax()) * STEP, way, stands)


def _is_far(way: Way, x: float, y: float, count: int, reach: float) -> bool:
    """True if ``count`` points of a dense path from (x, y) all stay more than ``reach`` m beside a hull on its way.

    Announced ways are not looked at: their points may lie farther apart than STEP.
    """
    return not way.name and not way.is_within(SPACING * count + STEP * len(way.points) + reach + way.radius, Pose(x, y))


def free_of_movers(path: Points, pose: Pose, radius: float, ways: Sequence[Way]) -> float:
    """Return the distance along ``path`` that stays clear of others that brake now, m; inf: all of it."""
    from roboglot.kernels.distance import meets_mover  # it needs Numba

    free, (x, y) = math.inf, path[0].tolist()
    for way in ways:
        if len(way.points) >= 2 and not _is_far(way, x, y, len(path), radius + CLEAR_MOVING):
            stops = way.speed * REACTION + way.speed**2 / (2.0 * DECELERATION)
            at = meets_mover(path, way.points, stops, pose.x, pose.y, radius + way.radius + CLEAR_MOVING)
            free = min(free, at * SPACING) if at >= 0 else free
    return free
