"""The estimator behind localization and mapping: matches every scan to the map, then adds it to the map.

Needs the kernels, so it is imported once they are loaded. Uses scans and odometry only.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.adding import Adding
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.certainty import ALL_POINTS, Support, is_well_painted, supported
from roboglot.autonomy.slam.contradictions import WheelWitness, is_long
from roboglot.autonomy.slam.displacement import DisplacementWatch
from roboglot.autonomy.slam.excursion import Excursions
from roboglot.autonomy.slam.loops import LoopCloser
from roboglot.autonomy.slam.matcher import (
    FREE,
    ITERATIONS_MAX,
    MATCH_POINTS_MAX,
    POINTS_MIN,
    WIDE,
    Match,
    fit,
    places,
    search,
    start_of_match,
)
from roboglot.autonomy.slam.odometry.learner import Correction, OdometryLearner
from roboglot.autonomy.slam.recovery.whereabouts import Whereabouts
from roboglot.autonomy.slam.recovery.whole_map_search import DOUBT_SHARE, KNOWN_SURE, LOST_PERIOD, WholeMapSearch
from roboglot.autonomy.slam.scan_points import ScanPoints, is_covered
from roboglot.autonomy.slam.slip import SlipWatch
from roboglot.autonomy.slam.trajectory import Trajectory, TrajectoryPoint
from roboglot.autonomy.slam.turns import Turns
from roboglot.model.components.mapping.localization import Region
from roboglot.model.events import (
    LoopClosed,
    LostReason,
    MapReplaced,
    PoseJumped,
    RecoveryMeans,
    RobotDisplaced,
    ScanTaken,
)
from roboglot.model.geometry import ORIGIN, Pose, wrap_angle
from roboglot.model.robot import Robot
from roboglot.values import dataclass

log = logging.getLogger(__name__)

AGREEMENT_MIN = 0.5  # share of the points on known ground that must fit for the pose to be corrected
AGREEMENT_TO_MAP = 0.6  # … for the scan to be added to the map
QUALITY_GAIN = 0.3  # weight of the newest scan in the quality
TRUSTED = 0.75  # agreement from which a match is used to judge odometry
NEW_GROUND = 0.3  # share of known points below which the scan counts as new ground
GAP_MAX = 0.35  # s between two scans up to which odometry's constant errors are learnt
BLIND = np.diag((0.5**2, 0.5**2, 0.3**2))  # variances after a gap in the scans
SURE_QUALITY = 0.85  # agreement from which contradictions of the map need not be checked
SILENCE_PERIOD = 0.5  # s between two checks for silence of the lidar
STILL, STILL_YAW = 0.002, math.radians(0.1)  # less motion than this between scans is standing
STILL_PERIOD = 0.5  # s between two matches while standing
LOST_QUALITY = 0.4  # quality below which to search around
NARROW = (0.2, math.radians(5.0))  # m, rad searched around the believed pose after a doubtful step
DOUBT_SIGMAS = 3.0  # a pose this far from odometry's: match without it
DISPLACED_QUALITY = 0.15  # of a displaced robot, until the next scans
JUMP, JUMP_YAW = 0.2, math.radians(10.0)  # larger corrections are reported as a jump


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion by odometry from one matched scan to the next.

    ``step``: in base_link at the first; ``way`` in m and ``turn`` in rad, both 0 while the wheels slip; ``seconds``
    between the two, 0 if the robot stood.
    """

    step: Pose = ORIGIN
    way: float = 0.0
    turn: float = 0.0
    seconds: float = 0.0

    @property
    def drives(self) -> bool:
        """True if the robot moved."""
        return self.way >= STILL or self.turn >= STILL_YAW

    @property
    def usable(self) -> Pose | None:
        """The step, if odometry's constant errors can be learnt from it."""
        return self.step if 0.0 < self.seconds < GAP_MAX else None


def motion_between(last: Pose, odometry: Pose, seconds: float) -> Motion:
    """Return the motion between two poses (odom)."""
    way, turn = odometry.distance_to(last), abs(wrap_angle(odometry.yaw - last.yaw))
    motion = Motion(odometry.relative_to(last), way, turn, seconds)
    return motion if motion.drives else Motion(motion.step, way, turn)


class Slam:
    """Estimator that listens to the lidar until ``close``."""

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot = robot
        self._belief = belief
        self._matched_odometry: Pose | None = None
        self._motion = Motion()  # at the last match
        self._matched_at = self._searched_at = -math.inf
        self._agreement = self._known = 1.0
        self._newest: ScanTaken | None = None
        self.odometry = OdometryLearner(belief.odometry.noise)
        self._witness = WheelWitness(self.odometry)
        self.whereabouts = Whereabouts(belief, robot.events)
        self._everywhere = WholeMapSearch(robot, belief, self.whereabouts, self.believe, lambda: self._way)
        self._slip, self._displacement = SlipWatch(robot.description.radius), DisplacementWatch()
        self._trajectory = Trajectory(belief)
        self._loops, self._way = LoopCloser(belief), 0.0  # m driven
        self._adding = Adding(robot, belief, self._loops)
        self._excursions = Excursions(
            belief, self.odometry.noise, lambda scan, pose: self._adding.paint(scan, pose, self._way)
        )
        belief.reader.load_kernel()
        self._turns = Turns(robot.clock, self._take)
        self._listeners = [
            robot.events.listen(ScanTaken, self._turns.put),
            robot.events.listen(PoseJumped, self._jumped),
            robot.events.listen(MapReplaced, self._replaced),
        ]
        self._timer = robot.clock.call_later(SILENCE_PERIOD, self._listen)

    def close(self) -> None:
        """Stop listening."""
        for stop in self._listeners:
            stop()
        self._turns.close()
        self._timer.cancel()

    def _listen(self) -> None:
        """Check for missing scans."""
        clock = self._robot.clock
        self.whereabouts.check_silence(clock.time())
        self._timer = clock.call_later(SILENCE_PERIOD, self._listen)

    def placing(self, region: Region | None) -> tuple[Pose, Callable[[], list[Match]]] | None:
        """Return odometry at the newest scan, and a function, for any thread, that finds its places on the map."""
        if self._newest is None or not self._belief.map.scans:
            return None
        belief, odometry, scan = self._belief, self._newest.odometry, self._belief.reader.read(self._newest.scan)
        known = None if self._is_unsure or belief.in_doubt else belief.map_to_odom.compose(odometry)
        grid = belief.map
        return (odometry, lambda: places(grid, scan, region, known=known)) if len(scan.points) >= POINTS_MIN else None

    @property
    def newest(self) -> ScanTaken | None:
        """The newest scan."""
        return self._newest

    @property
    def way(self) -> float:
        """Distance driven, m."""
        return self._way

    def settle(self) -> None:
        """Finish straightening the map now."""
        while self._loops.straightening and self._newest is not None:
            self._straighten(self._newest.odometry, self._newest.stamp)

    def trajectory(self) -> list[TrajectoryPoint]:
        """Return the poses of the scans since the map's beginning, with all later corrections."""
        return self._trajectory.points(self._loops.keyframes)

    def _jumped(self, event: PoseJumped) -> None:
        """Forget the past of a pose that jumped; let the next scans check one that was given."""
        self._displacement.forget(event.stamp)
        if event.given:
            self._turns.forget()
            self._everywhere.note_given(event.stamp)
            self._witness.forget()
            self.whereabouts.note_given(event.stamp)

    def _replaced(self, event: MapReplaced) -> None:
        """Forget poses in the frame of a map that was cleared, or whose origin was moved."""
        if event.origin != ORIGIN:
            self._displacement.forget(event.stamp)
            self._witness.forget()
            self._slip.forget()

    @property
    def started(self) -> bool:
        """True once a scan has been compared with the map."""
        return self._matched_odometry is not None

    def believe(self, found: Match, odometry: Pose, means: RecoveryMeans = RecoveryMeans.WHOLE_MAP) -> None:
        """Believe a found pose at the time of ``odometry`` (odom)."""
        self._belief.move_to(found.pose, odometry)
        self._witness.forget()
        self._belief.covariance, self._belief.doubt, self._belief.search = found.covariance, found.doubt(), False
        self._belief.quality, self._agreement = found.quality, found.agreement
        self.whereabouts.find(means, self._newest.stamp if self._newest else self._robot.clock.time())

    def _take(self, event: ScanTaken) -> None:
        belief, odometry, self._newest = self._belief, event.odometry, event
        self._straighten(odometry, event.stamp)
        if not len(belief.reader.read(event.scan).ends) and is_covered(event.scan.ranges):
            belief.quality *= 1.0 - QUALITY_GAIN
            return  # a covered lidar sends empty scans: treat it as silent
        if self.whereabouts.note_scan(event.stamp) and belief.map.scans and belief.localizing:
            belief.widen(belief.covariance + BLIND)
            self._excursions.forget()
            self.whereabouts.lose(LostReason.NO_SCANS, event.stamp)
        motion = motion_between(self._matched_odometry or odometry, odometry, event.stamp - self._matched_at)
        stands = not motion.drives and event.stamp - self._matched_at < STILL_PERIOD
        if stands and not (self._is_unsure or belief.asked):
            return
        # Objects known to stand there are no evidence on the map, nor on a loaded one the dock that the robot touches.
        scan = belief.reader.read(event.scan).beside(Pose(), belief.attached if belief.frame else ())
        scan = scan.beside(belief.map_to_odom.compose(odometry), belief.others)
        if len(scan.points) < POINTS_MIN:
            belief.quality *= 1.0 - QUALITY_GAIN
            return
        last = self._matched_odometry
        if last and self._slip.holds(belief, event.scan, odometry, last):
            motion = Motion(motion.step)
        self._matched_odometry, self._matched_at, self._motion = odometry, event.stamp, motion
        belief.compared_at, belief.asked = event.scan.stamp, False
        self._way += motion.way
        spread = self.odometry.spread(belief.covariance, motion.way, motion.turn, motion.usable, motion.seconds)
        belief.widen(spread)
        self._use(scan, odometry, event.stamp)

    def _use(self, scan: ScanPoints, odometry: Pose, stamp: float) -> None:
        """Localize by the scan, add it to the map, and search the whole map if it does not fit."""
        belief, motion, searches = self._belief, self._motion, False
        if belief.map.scans:
            searches = self._correct(scan, odometry, stamp)
        else:
            belief.quality = self._agreement = self._known = 1.0  # the first scan defines the map
            self.whereabouts.begin()
        pose = belief.map_to_odom.compose(odometry)
        self._witness.note(stamp, pose, self._way)
        if belief.mapping and self._may_add and self._adding.is_due(pose, stamp):
            self._adding.add(scan, pose, stamp, self._way)
        sure = self._may_add and self._agreement >= TRUSTED and self._known > NEW_GROUND
        self._excursions.take(scan, odometry, motion.step, motion.turn, sure=sure)
        self._trajectory.follow(stamp, odometry, self._loops.anchor, drives=motion.drives)
        if searches:  # last: in lockstep the found pose is set at once, and nothing may change it
            self._everywhere.start(scan, odometry, stamp, self._agreement)

    @property
    def _is_unsure(self) -> bool:
        return self._belief.search or self._belief.lost is not None or not self.whereabouts.sure

    def _correct(self, scan: ScanPoints, odometry: Pose, stamp: float) -> bool:
        """Match the scan, judge the fit, and move the belief if it localizes. Return whether to search everywhere."""
        belief, moved, seconds = self._belief, self._motion.usable, self._motion.seconds
        if belief.localizing and moved:
            missing = self.odometry.bias.missing(moved, seconds)
            belief.move_to(belief.map_to_odom.compose(odometry).compose(missing), odometry)
        before = belief.map_to_odom.compose(odometry)
        iterations = ITERATIONS_MAX if belief.localizing else 0
        prior, start = belief.covariance, self._coarse(scan, before, stamp) if belief.localizing else before
        most = MATCH_POINTS_MAX if start is before else ALL_POINTS  # after a large step every point counts
        best = fit(belief.map, scan, before, prior, start=start, iterations=iterations, most=most)
        driven = None
        if belief.localizing:
            best = self._doubted(best, scan, before, stamp)
            driven = self._contested(best, scan, before, prior)
        best, belief.contradicted, belief.denied = driven or best, driven is not None, False
        self._agreement, self._known = best.agreement, best.known / max(1, best.points)
        usual = belief.quality
        belief.quality += (1.0 if belief.search else QUALITY_GAIN) * (best.quality - belief.quality)
        belief.search = False
        if not belief.localizing:
            self._witness.forget()
            return False
        searches = self._judge(best, scan, stamp, usual)
        if best.fit < POINTS_MIN or best.agreement < AGREEMENT_MIN:
            return searches
        shoved = self._check_displaced(before, best, prior, stamp)
        if shoved is None and driven is None and _is_sure(best):
            moved = moved if belief.lost is None else None
            step, pose = self._motion.step, best.pose
            correction = Correction(before, best, prior, step, moved, seconds)
            self.odometry.learn(correction, self._way, lambda: is_long(step) or is_well_painted(belief.map, scan, pose))
        if driven is None:
            belief.covariance, belief.doubt = best.covariance, best.doubt(belief.doubt)
        belief.move_to(best.pose, odometry)
        if shoved is not None and self._displacement.slips:
            belief.slipped += shoved
        elif shoved is not None:
            self._doubt(shoved, stamp)
        if best.pose.distance_to(before) > JUMP or abs(wrap_angle(best.pose.yaw - before.yaw)) > JUMP_YAW:
            self._robot.events.publish(PoseJumped(stamp=stamp, pose=best.pose))
        return searches

    def _contested(self, best: Match, scan: ScanPoints, before: Pose, prior: NDArray[np.float64]) -> Match | None:
        """Return the pose by odometry while moving things mislead the match, else None."""
        if self._belief.search or self._belief.in_doubt:  # badly fitting scans alone do not justify consulting it less
            self._witness.forget()
            return None
        driven = self._witness.contest(self._belief.map, scan, before, best, prior, self._motion.step)
        if driven is not None:
            self.odometry.contradict(self._way)
        return driven

    def _check_displaced(self, before: Pose, best: Match, prior: NDArray[np.float64], stamp: float) -> float | None:
        """Return the robot's displacement (m) by anything but its wheels; None: there was none."""
        if self._belief.in_doubt or not _is_sure(best):
            self._displacement.forget(stamp)
            return None
        return self._displacement.check(stamp, before, best.pose, prior, self._motion.step)

    def _doubt(self, shoved: float, stamp: float) -> None:
        """Report a displacement, search around, and doubt the pose until scans confirm it."""
        log.warning("robot %s was displaced by %.2f m", self._robot.id, shoved)
        self._belief.search, self._belief.quality = True, min(self._belief.quality, DISPLACED_QUALITY)
        self.whereabouts.be_displaced(stamp)
        self._robot.events.publish(RobotDisplaced(stamp=stamp, distance=shoved))

    def _judge(self, best: Match, scan: ScanPoints, stamp: float, usual: float) -> bool:
        """Judge the pose by the map's support; return whether to search everywhere: lost, or worse than ``usual``."""
        belief = self._belief
        if best.agreement < SURE_QUALITY or best.known < KNOWN_SURE * best.points or self._is_unsure:
            self.whereabouts.judge(supported(belief.map, scan, best.pose), stamp)
        else:
            self.whereabouts.judge(Support(best.points, best.fit, 0, 0), stamp)
        return self._everywhere.is_due(best, usual, self._motion.step, stamp)

    def _coarse(self, scan: ScanPoints, before: Pose, stamp: float) -> Pose:
        """Return the start pose of the match, by a search if odometry may be too far off."""
        if self._belief.lost is not None and self._everywhere.was_recent(stamp):
            return before
        return start_of_match(self._belief.map, scan, before, self._belief.covariance)

    def _doubted(self, best: Match, scan: ScanPoints, before: Pose, stamp: float) -> Match:
        """Return ``best``, or a better match without odometry, as wheels slip and robots are pushed."""
        belief = self._belief
        lost = belief.quality < LOST_QUALITY and stamp - self._searched_at >= LOST_PERIOD
        if belief.search or lost:
            self._searched_at = stamp
            start = search(belief.map, scan, before, WIDE)
        elif best.agreement < DOUBT_SHARE * min(1.0, belief.quality) and belief.quality >= LOST_QUALITY:
            start = search(belief.map, scan, before, NARROW)
        elif best.strain > DOUBT_SIGMAS**2:
            start = best.pose
        else:
            return best
        found = fit(belief.map, scan, start, FREE)
        return found if found.fit >= best.fit else best

    @property
    def _may_add(self) -> bool:
        """Return whether the newest scan may be added to the map."""
        if not self._belief.map.scans or not self._belief.localizing:
            return True
        fits = self._agreement >= AGREEMENT_TO_MAP or self._known <= NEW_GROUND
        proven = self.whereabouts.sure and self._way >= self._everywhere.mapped_from
        return fits and proven and not self._belief.contradicted

    def _straighten(self, odometry: Pose, stamp: float) -> None:
        """Continue straightening after a closed loop; at the end, move the belief to the corrected pose."""
        belief, loops = self._belief, self._loops
        pose = belief.map_to_odom.compose(odometry) if loops.straightening else None
        if pose is None or (straightened := loops.advance(pose)) is None:
            return
        belief.move_to(straightened, odometry)
        self._witness.forget()
        self._adding.shift(straightened)
        shift = straightened.distance_to(pose)
        self._robot.events.publish(LoopClosed(stamp=stamp, shift=shift, moved=self._loops.moved))
        self._robot.events.publish(PoseJumped(stamp=stamp, pose=straightened))


def _is_sure(best: Match) -> bool:
    """Return whether the match is good enough to judge odometry by it."""
    return best.agreement >= TRUSTED and best.known >= KNOWN_SURE * best.points
