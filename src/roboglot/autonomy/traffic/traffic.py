"""One robot among others: tracks their motion and announcements, announces its own way, and decides where to wait."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.route import SPACING
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.traffic.announcer import Announcer
from roboglot.autonomy.traffic.narrow_places import BETWEEN, NarrowPlaces
from roboglot.autonomy.traffic.one_way import OneWayStretches
from roboglot.autonomy.traffic.right_of_way import (
    ALIKE,
    CLEAR,
    STEP,
    THROUGH,
    Meeting,
    Way,
    announced_way,
    expected_way,
    free_of_movers,
    meetings,
    shifted,
    straight_on,
    through_narrow,
)
from roboglot.model.components.logistics.traffic_radio import Announcement
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot

if TYPE_CHECKING:
    from roboglot.autonomy.traffic.movers import Mover, MoverTracker

ANNOUNCED = 5.0  # m of the route that are announced, plus any narrow place beyond
SAME = 0.6  # m between the sighting and the announcement of the same robot
BEFORE_NARROW = 0.6  # m in front of a narrow place where the robot waits: one that comes out has room to turn
FACING = 0.27 + 0.5  # m between a hull and the centre of the object in front of it
AROUND = 4.0  # m within which other robots may be the obstacle
TRAVELLED_MIN = 1.0  # m from its first place that prove a thing to move: more than any is wide
PARKED = 60.0  # s after its last motion for which a thing in sight stays off the map
UNDER_WAY_FOR = 8.0  # s after its last motion for which a robot counts as under way
FAR = 3.0  # m at which such robots will have left before the robot arrives
PROVEN = 0.4  # s for which a thing must be seen to go first: ghosts of walls, in a turn, last shorter
STOPPED = 5.0  # s after which a robot standing in a narrow place may reverse, too
SOON = 4.0  # s in which the robot will have left the first metres of its route
LEAVING_SPEED = 0.2  # m/s of a robot that leaves its place
BLOCKED_WITHIN = 0.9  # m between the centre of such a robot and the place that it blocks
TRAIL = 20  # places that were passed
TRAIL_STEP = 0.2  # m between two of them

Points = NDArray[np.float64]


class Traffic:
    """Traffic around one robot, which announces its pose until ``close``; drives ask for the rest."""

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot, self._belief = robot, belief
        self._announcer = Announcer(robot, belief)
        self._tracker: MoverTracker | None = None  # set once something drives: it needs the kernels
        self._narrow_places = NarrowPlaces(robot.clock, belief)
        self._ways: list[Way] = []
        self._one_way = OneWayStretches()
        self._way_announced_at: dict[str, float] = {}  # time of the last announced route by robot, s
        self._trail: deque[Point] = deque(maxlen=TRAIL)
        self.meeting: Meeting | None = None  # with a robot that goes first
        self.meets_others = False  # whether another robot is about to enter the route
        self.giving_way = False  # the robot has to leave: no rule holds it up

    def close(self) -> None:
        """Stop announcing."""
        self._announcer.close()

    # -- others --

    def observe(self, echoes: Points, pose: Pose, stamp: float) -> None:
        """Track the motion of others; ``echoes`` (n, 2; map) in the order of the scan."""
        if not self._trail or self._trail[-1].distance_to(pose) > TRAIL_STEP:
            self._trail.append(pose.point)
        heard = self._announcer.heard(stamp)
        movers = [*self._mover_tracker().observe(echoes, self._belief.map, pose, stamp)]
        if heard:
            movers = [one for one in movers if not any(one.point.distance_to(other.pose) < SAME for other in heard)]
        self._announcer.watch((m.x, m.y, m.radius, m.speed) for m in movers if _is_passing(m, self._belief.map, stamp))
        inside = partial(self._is_inside, pose, heard, movers, stamp)  # most movers are far from narrow places
        self._announcer.inside = bool(heard or self._announcer.frame) and inside()
        self._ways = []
        if heard:
            mine = self._announcer.announcement(stamp)
            self._ways = [announced_way(other, mine, under_way=self._is_under_way(other)) for other in heard]
        present = {other.robot for other in heard}
        self._way_announced_at = {name: at for name, at in self._way_announced_at.items() if name in present}
        self._ways += [_expected(self._narrow_places, mover, pose, stamp, inside) for mover in movers]
        self._one_way.observe(self._ways, stamp)

    def _is_inside(self, pose: Pose, heard: list[Announcement], movers: list[Mover], stamp: float) -> bool:
        """True if the robot is in a narrow place, and there are others."""
        if not heard and not any(stamp - mover.moved_at <= UNDER_WAY_FOR for mover in movers):
            return False
        behind = [(point.x, point.y) for point in self._trail]
        ahead = self._announcer.way[: round(BETWEEN / STEP)].tolist()
        line = np.array([(pose.x, pose.y), *behind, (pose.x, pose.y), *ahead])
        return bool(self._narrow_places.along(line, STEP, skipped=1)[len(behind)])

    def _is_under_way(self, other: Announcement) -> bool:
        """True if another robot announces a way, or did so a moment ago."""
        if other.way:
            self._way_announced_at[other.robot] = other.stamp
        return other.stamp - self._way_announced_at.get(other.robot, -math.inf) <= UNDER_WAY_FOR

    def _mover_tracker(self) -> MoverTracker:
        if self._tracker is None:
            from roboglot.autonomy.traffic.movers import MoverTracker

            self._tracker = MoverTracker()
        return self._tracker

    @property
    def moving_places(self) -> list[Point]:
        """Current places of moving robots and things, and of those with a route."""
        return [Point(*way.points[0].tolist()) for way in self._ways if len(way.points) >= 2]

    def far_places(self, pose: Pose) -> list[Point]:
        """Return the places of others that will have left before the robot gets there."""
        return [Point(*way.points[0].tolist()) for way in self._ways if way.under_way and not way.is_within(FAR, pose)]

    def is_blocked_by_others(self, place: Point, *, moving: bool = False) -> bool:
        """True if another robot that is under way is there, and will leave; ``moving``: only if it does so now."""
        here, least = Pose(place.x, place.y), LEAVING_SPEED if moving else 0.0
        return any(way.under_way and way.speed >= least and way.is_within(BLOCKED_WITHIN, here) for way in self._ways)

    def seconds_until_clear(self, path: Points) -> float:
        """Return the time until all others are expected to have left ``path`` (dense), s; inf: one will not."""
        from roboglot.kernels.distance import directions  # it needs Numba

        radius, latest = self._robot.description.radius + CLEAR, 0.0
        mine = np.ascontiguousarray(path[:: round(STEP / SPACING)])
        for way in self._ways if len(mine) >= 2 else ():
            close = way.distances(mine) < radius + way.radius
            on = np.flatnonzero(close.any(axis=0))
            if not len(on):
                continue
            if way.speed < LEAVING_SPEED or len(way.points) < 2:
                return math.inf
            last = int(on[-1])
            beside = int(way.distances(mine)[:, last].argmin())
            if float(directions(mine)[beside] @ directions(way.points)[last]) > ALIKE:
                continue  # it drives ahead
            if last == len(way.points) - 1:
                return math.inf
            latest = max(latest, float(way.seconds[last]))
        return latest

    def is_among_others(self, pose: Pose) -> bool:
        """True if other robots or things that are under way are near."""
        return any(way.under_way and way.is_within(AROUND, pose) for way in self._ways)

    @property
    def needs_whole_way(self) -> bool:
        """True if more than the robot's next metres matter: there are others, or they listen."""
        return bool(self._ways or self._announcer.frame)

    def free_distance(self, path: Points, way: Points, pose: Pose, speed: float, radius: float) -> float:
        """Return the distance along ``path`` (dense) free of movers and of others' right of way, m; inf: all.

        ``way`` (dense): the path and its continuation.
        """
        if not self._ways:
            self.meeting, self.meets_others = None, False
            return math.inf
        free = free_of_movers(path, pose, radius, self._ways)
        found = [] if self.giving_way else list(meetings(path, speed, radius, self._ways))
        self.meets_others = any(meeting.way.outranks or not meeting.way.name for meeting in found)
        ruled = [meeting for meeting in found if meeting.way.outranks]
        self.meeting = min(ruled, key=lambda meeting: meeting.along, default=None)
        if self.meeting is None and not self.giving_way:
            places, now = self._narrow_places, self._robot.clock.time()
            if not places.contains(pose.point, Point(*way[0].tolist())):
                self.meeting = self._one_way.meeting(way, lambda: places.along(way), speed, radius, self._ways, now)
        if self.meeting is not None:
            self.meets_others, free = True, min(free, self._before_narrow(way, self.meeting, radius))
        return free

    def _before_narrow(self, path: Points, meeting: Meeting, radius: float) -> float:
        """Return the distance to the waiting point for ``meeting``, outside of narrow places and of the other's way, m.

        In the other's way only where the robot is in it already.
        """
        narrow = self._narrow_places.along(path)
        last = min(int(meeting.along / SPACING), len(narrow) - 1)
        if narrow[0] or not narrow[last]:
            return meeting.along
        entry = int(np.flatnonzero(~narrow[: last + 1])[-1])
        entry = max(0, entry - round(BEFORE_NARROW / SPACING))
        away = meeting.way.distances(path[: entry + 1]).min(axis=1)
        clear = np.flatnonzero(away >= radius + meeting.way.radius + CLEAR)
        return float(clear[-1] if len(clear) else entry) * SPACING

    def ways_to_avoid(self) -> list[tuple[Points, float]]:
        """Return ways to avoid, with their distances (m): of robots with right of way or without announcements."""
        mine = self._robot.description.radius
        return [
            (way.points if way.outranks else shifted(way), mine + way.radius + CLEAR)
            for way in self._ways
            if len(way.points) >= 2 and (way.outranks or not way.name)
        ]

    def ways_to_clear(self) -> list[tuple[Points, float]]:
        """Return the ways that a robot giving way must leave clear, with their distances (m)."""
        mine = self._robot.description.radius
        return [(way.points, mine + way.radius + 2 * CLEAR) for way in self._ways if way.outranks or not way.name]

    def is_in_the_way(self, pose: Pose) -> bool:
        """True if the robot stands in the way of another with right of way."""
        here, mine = np.array([(pose.x, pose.y)]), self._robot.description.radius + CLEAR
        return any(
            way.outranks and len(way.points) >= 2 and bool((way.distances(here) < mine + way.radius).any())
            for way in self._ways
        )

    def is_beside(self, pose: Pose) -> bool:
        """True if all that go first drive past ``pose``, or none does."""
        here = np.array([(pose.x, pose.y)])
        return not any(
            len(points) >= 2 and bool((np.hypot(*(points - here).T) < reach).any())
            for points, reach in self.ways_to_clear()
        )

    def is_faced(self, pose: Pose) -> bool:
        """True if another robot, or a person, may stand close."""
        reach = self._robot.description.radius + FACING
        return any(way.is_within(reach, pose) for way in self._ways)

    def should_back_out(self, pose: Pose) -> bool:
        """True if the way back out of a narrow place is shorter for this robot than for one that announces nothing.

        Both can see that, so they agree without words; straight on counts.
        """
        reach, here = self._robot.description.radius + FACING, np.array((pose.x, pose.y))
        faced = [way.points[0] for way in self._ways if not way.name and way.is_within(reach, pose)]
        if not faced:
            return False
        there = min(faced, key=lambda point: float(np.hypot(*(point - here))))
        back = (here - there) / max(float(np.hypot(*(here - there))), 1e-6)
        steps = np.arange(0.0, THROUGH, STEP)[:, None]
        line = np.concatenate([[here], (here + steps * back)[::-1], there - steps * back])
        narrow = self._narrow_places.along(line, STEP, skipped=1)
        mine, others = narrow[: len(steps)][::-1], narrow[len(steps) :]
        if not (mine[0] and others[0]):
            return False
        return int(np.argmin([*mine, False])) < int(np.argmin([*others, False]))

    def ways_of_faced(self, pose: Pose) -> list[tuple[Points, float]]:
        """Return the way that robots close by may need: where this one came from, with its distance (m)."""
        mine, trail = self._robot.description.radius, [(point.x, point.y) for point in self._trail]
        near = [tuple(way.points[0].tolist()) for way in self._ways if way.is_within(mine + FACING, pose)]
        return [(np.array([*trail, (pose.x, pose.y), *near]), 2 * mine + CLEAR)]

    def is_free(self, path: Points, *, ruled: bool) -> bool:
        """True if no other is near ``path`` soon; ``ruled``: only those with right of way count."""
        mine = self._robot.description.radius + CLEAR
        ways = [way for way in self._ways if way.outranks or not ruled]
        return not any((way.distances(path) < mine + way.radius)[:, way.seconds < SOON].any() for way in ways)

    # -- itself --

    def follow(self, path: Points) -> None:
        """Announce a drive along ``path`` (dense), up to the place to wait for others."""
        announcer = self._announcer
        if not announcer.frame:
            return
        end = round(ANNOUNCED / SPACING)
        if self._ways and end < len(path):
            narrow = self._narrow_places.along(path)
            while end < len(narrow) and narrow[end]:
                end += 1
        if self.meeting is not None:
            end = min(end, int(self.meeting.along / SPACING))
        announcer.way = path[: end : round(STEP / SPACING)]

    def rest(self) -> None:
        """Announce that the robot has no goal."""
        self._announcer.way, self.meeting, self.meets_others = np.empty((0, 2)), None, False
        self._announcer.watch(())


def _is_passing(mover: Mover, grid: EvidenceGrid, stamp: float) -> bool:
    """True if a thing on free floor came from elsewhere while it was in sight: a robot or a person, no furniture.

    What shows another side of itself to a robot that drives around it seems to move, too, but not as far.
    """
    if stamp - mover.moved_at > PARKED or mover.travelled < TRAVELLED_MIN:
        return False
    row = math.floor(mover.y / RESOLUTION) - grid.first_row
    column = math.floor(mover.x / RESOLUTION) - grid.first_column
    within = 0 <= row < grid.evidence.shape[0] and 0 <= column < grid.evidence.shape[1]
    return within and bool(grid.evidence[row, column] < 0)


def _expected(narrow_places: NarrowPlaces, mover: Mover, pose: Pose, stamp: float, inside: Callable[[], bool]) -> Way:
    """Return the way of a robot that announces none: it goes first if only it is in a narrow place."""
    stood, proven = stamp - mover.moved_at, stamp - mover.since >= PROVEN
    if proven and stood <= STOPPED and narrow_places.contains(pose.point, mover.point) and not inside():
        points = straight_on(mover, THROUGH)
        narrow = narrow_places.along(np.concatenate([[(pose.x, pose.y)], points]), STEP, skipped=1)
        return through_narrow(mover, points, narrow)
    return expected_way(mover, under_way=stood <= UNDER_WAY_FOR)
