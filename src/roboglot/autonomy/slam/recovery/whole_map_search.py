"""Search of the whole map by a robot that is lost, or whose scans fit worse than they did."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

from roboglot.autonomy.computing import compute_soon
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.contradictions import STOOD
from roboglot.autonomy.slam.matcher import Match, places
from roboglot.autonomy.slam.recovery.distant_places import NEAR, DistantPlaces
from roboglot.autonomy.slam.recovery.fruitless_searches import FruitlessSearches, View, nearest_echoes
from roboglot.autonomy.slam.recovery.whereabouts import Whereabouts
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.model.events import LostReason, PoseJumped, RecoveryMeans
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot

BETTER = 0.08  # the gain in agreement that another place needs over the believed one
LOST_PERIOD = 1.0  # s between searches, or decisions to leave them out
FELL_PERIOD_MAX = 16.0  # s between searches, which become rarer, while the fit stays worse than it was
DOUBT_SHARE = 0.85  # share of its usual agreement below which a scan fits worse
KNOWN_SURE = 0.6  # share of known points from which agreement alone suffices
PROBATION = 3.0  # m to drive without contradiction after a distant relocalization, before scans are added there


class PlaceReplacement:
    """Decides whether another place, found by a search, replaces the believed one of a robot that is not lost."""

    def __init__(self) -> None:
        self._distant = DistantPlaces()
        self._fitted: object = None  # the last map that a scan fitted at the believed pose

    def note_fit(self, grid: object) -> None:
        """Note that a scan fits this map at the believed place."""
        self._distant.forget()
        self._fitted = grid

    def is_new(self, grid: object) -> bool:
        """Return whether no scan has fitted this map yet."""
        return grid is not self._fitted

    def replaces(
        self, found: Match, odometry: Pose, belief: Belief, agreement: float, *, given: bool, stood: bool
    ) -> bool:
        """Return whether to believe ``found`` instead of the believed place, whose ``agreement`` is given.

        In a crowd that moves along with the robot, scans fit best where it was before: while it drives, nearby places
        are ignored.
        """
        believed = belief.map_to_odom.compose(odometry)
        near = found.pose.distance_to(believed) < NEAR
        if not (near if given else not near or stood) or found.agreement < agreement + BETTER:
            return False
        return self.is_certain(found, odometry, belief) or near

    def is_certain(self, found: Match, odometry: Pose, belief: Belief) -> bool:
        """Return whether to believe a distant place: if this map has fitted before, two searches must find it."""
        return self._distant.add(found.pose, odometry) or self.is_new(belief.map)


class WholeMapSearch:
    """Searches of the whole map for the place of a scan, one at a time.

    ``believe`` moves the robot to a found place; ``way`` returns the distance driven, m.
    """

    def __init__(
        self,
        robot: Robot,
        belief: Belief,
        whereabouts: Whereabouts,
        believe: Callable[[Match, Pose, RecoveryMeans], None],
        way: Callable[[], float],
    ) -> None:
        self._robot, self._belief, self._whereabouts = robot, belief, whereabouts
        self._believe, self._way = believe, way
        self._searched_at, self._searching, self._given_at = -math.inf, False, -math.inf
        self._pause = LOST_PERIOD  # s from a search to the next while the robot is not lost
        self._missed, self._fell_at = 0.0, 0.0  # agreement before it fell (0: it has not), and m driven at that time
        self._replacement, self._fruitless = PlaceReplacement(), FruitlessSearches()
        self._unseen = False  # whether a client gave a pose that was not compared with the whole map yet
        self._search: asyncio.Task[None] | None = None
        self.mapped_from = 0.0  # m driven from which scans are added to the map again

    def note_given(self, stamp: float) -> None:
        """Note that a client gave a pose, which the next scans compare with the whole map."""
        self._given_at, self._missed, self._unseen = stamp, 0.0, True
        self._fruitless.forget()

    def was_recent(self, stamp: float) -> bool:
        """Return whether the map was searched less than a lost robot's period ago."""
        return stamp - self._searched_at < LOST_PERIOD

    def is_due(self, best: Match, usual: float, step: Pose, stamp: float) -> bool:
        """Return whether to search, as the robot is lost, or its scan fits worse than the ``usual`` agreement.

        ``step``: motion by odometry since the last match.
        """
        belief = self._belief
        if belief.lost is None and not self._unseen:
            self._fell_at = self._fell_at if self._missed else self._way() - math.hypot(step.x, step.y)
            self._missed = max(self._missed, usual)
            if best.agreement >= DOUBT_SHARE * self._missed or best.known < KNOWN_SURE * best.points:
                self._pause, self._missed = LOST_PERIOD, 0.0
                self._replacement.note_fit(belief.map)
                return False
        return not self._searching and stamp - self._searched_at >= (LOST_PERIOD if belief.lost else self._pause)

    def start(self, scan: ScanPoints, odometry: Pose, stamp: float, agreement: float) -> None:
        """Search the whole map for the place of ``scan``, but more and more rarely if a lost robot only sees the same.

        A believed place, which the scan fits with this ``agreement``, is only given up for a much better one.
        """
        belief, grid = self._belief, self._belief.map
        self._searched_at = stamp
        view = View(grid, grid.scans, odometry, nearest_echoes(scan))
        if belief.lost is None:
            self._fruitless.forget()
        elif self._fruitless.forbid(view, stamp):
            return
        given, self._unseen = self._unseen and belief.lost is None, False
        anywhere = self._replacement.is_new(grid)  # on a map just loaded
        self._searching = True
        self._pause = min(2.0 * self._pause, FELL_PERIOD_MAX)

        def then(found: list[Match]) -> None:
            self._searching = False
            self._whereabouts.forget_places()
            if len(found) == 1:  # a distant place has to be found once more, soon
                self._fruitless.forget()
            else:
                self._fruitless.add(view, stamp)
            if found and belief.map is grid and belief.localizing and self._given_at <= stamp:
                self._judge(found, odometry, stamp, agreement, given=given, anywhere=anywhere)

        self._search = compute_soon(self._robot.clock, lambda: places(grid, scan, None), then)

    def _judge(
        self, found: list[Match], odometry: Pose, stamp: float, agreement: float, *, given: bool, anywhere: bool
    ) -> None:
        """Believe the best place that was found, or note that the scan may be from several.

        ``given``: whether a client gave the believed place; ``anywhere``: whether no scan has fitted this map yet.
        """
        belief = self._belief
        pose = belief.map_to_odom.compose(odometry)
        if given:  # the client's pose decides between places that look alike
            found = [match for match in found if match.pose.distance_to(pose) < NEAR] or found
        near, lost = found[0].pose.distance_to(pose) < NEAR, belief.lost is not None
        if not lost:
            stood, meant = anywhere or self._way() - self._fell_at <= STOOD, given and not anywhere
            if not self._replacement.replaces(found[0], odometry, belief, agreement, given=meant, stood=stood):
                return
            if not given or len(found) > 1:
                self._whereabouts.lose(LostReason.NO_FIT, stamp)
        doubtful = lost and not near and not self._replacement.is_certain(found[0], odometry, belief)
        if len(found) > 1 or doubtful:
            self._whereabouts.be_ambiguous(found, pose)
            return
        self.mapped_from = self._way() + (0.0 if near else PROBATION)
        self._believe(found[0], odometry, RecoveryMeans.NEARBY if near else RecoveryMeans.WHOLE_MAP)
        self._robot.events.publish(PoseJumped(stamp=self._robot.clock.time(), pose=belief.pose))
