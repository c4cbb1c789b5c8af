"""Monitors the path ahead by every scan: obstacles, narrow passages, the width of gaps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.context import NavigationContext
from roboglot.autonomy.navigation.follower import PERIOD, Follower
from roboglot.autonomy.navigation.low_sight import LowSight
from roboglot.autonomy.navigation.narrow_passage import NarrowPassage
from roboglot.autonomy.navigation.route import SPACING
from roboglot.model.actions import Action
from roboglot.model.components.motion.base import Base
from roboglot.model.errors import Blocked
from roboglot.model.events import CorridorEntered, PathBlocked, ScanTaken
from roboglot.model.geometry import Point, Pose

if TYPE_CHECKING:
    from roboglot.autonomy.navigation.planner import Planner

FOLLOWS = 0.3  # m/s above which a robot among others is not held up, but drives behind one
ANNOUNCED_MAX = 12.0  # m of the planned way that are announced to others


class PathMonitor:
    """Monitor on every scan until ``close``; ``follower``: set while there is a route to check."""

    def __init__(self, context: NavigationContext, planner: Planner, action: Action) -> None:
        self._robot, self._clock, self._belief = context.robot, context.robot.clock, context.belief
        self._tuning, self._planner, self._action = context.tuning, planner, action
        self._traffic = context.traffic
        self._narrow, self._low = NarrowPassage(planner.radius), LowSight(context.robot)
        self._scan_at = -math.inf
        self.follower: Follower | None = None
        self.blocked, self.blocked_at = False, -math.inf
        self.blocked_place = Point()  # in map; of the obstacle that blocks the way
        self.gap = math.inf  # m: the narrowest gap that was ahead lately
        self._stop = self._robot.events.listen(ScanTaken, self._see)

    def close(self) -> None:
        """Stop listening."""
        self._stop()

    @property
    def has_recent_scan(self) -> bool:
        """True if the newest scan is recent enough to drive."""
        return self._clock.time() - self._scan_at <= self._tuning.scan_age_max

    def monitors(self, follower: Follower) -> bool:
        """True if it checks this route, and has a recent scan."""
        return self.follower is follower and self.has_recent_scan

    @property
    def gap_message(self) -> str:
        """Message about a gap too narrow for the hull; "" if there is none."""
        needed = 2.0 * (self._planner.radius + self._tuning.touch_margin)
        return f": a gap is {self.gap:.2f} m wide, {needed:.2f} m are needed" if self.gap < needed else ""

    async def first_scan(self) -> None:
        """Wait for a recent scan. Raises Blocked if there is none in time, Refused at once if the base is held."""
        deadline = self._clock.time() + self._tuning.patience
        while not self.has_recent_scan:
            if (refusal := self._robot[Base].refusal) is not None:
                raise refusal.again()
            if self._clock.time() > deadline:
                raise Blocked("the lidar is silent")
            await self._clock.sleep(PERIOD)

    def _see(self, event: ScanTaken) -> None:
        scan = self._belief.reader.read(event.scan)
        if not len(scan.points):
            return
        pose = self._belief.map_to_odom.compose(event.odometry)
        points = self._planner.observe(scan, pose, event.stamp)
        low = self._planner.observe_low(self._low.look(), points, pose, event.stamp)
        points = np.concatenate((points, low)) if len(low) else points
        self._scan_at = event.stamp
        self._traffic.observe(points, pose, event.stamp)
        self._planner.forget_soon(self._traffic.moving_places, event.stamp)
        self._planner.forget(self._traffic.far_places(pose))
        if self.follower:
            beside = self._planner.low_around(pose, self._tuning.horizon, event.stamp)
            self._look_ahead(self.follower, pose, points, beside)
            if (width := self._narrow.entered(scan.points)) is not None:
                self._robot.events.publish(CorridorEntered(stamp=event.stamp, action=self._action, width=width))

    def _look_ahead(
        self, follower: Follower, pose: Pose, seen: NDArray[np.float64], remembered: NDArray[np.float64]
    ) -> None:
        """Find obstacles on the route among the points ``seen`` now and ``remembered`` as cells (map)."""
        tuning, planner, aim = self._tuning, self._planner, follower.carrot()
        path = follower.route.ahead(pose, *aim, tuning.horizon)
        points = np.concatenate((seen, remembered)) if len(remembered) else seen
        tight = planner.free_way(path, points, pose, tuning.slow_margin)
        if math.isfinite(tight):
            self.gap, moved = follower.route.centre(seen, planner.radius + tuning.slow_margin)
            if moved:
                aim = follower.carrot()
                path = follower.route.ahead(pose, *aim, tuning.horizon)
                tight = planner.free_way(path, points, pose, tuning.slow_margin)
        follower.slow_at = follower.along + tight
        free = planner.free_way(path, points, pose, tuning.touch_margin) if math.isfinite(tight) else tight
        follower.stop_at, blocked = follower.along + free, math.isfinite(free)
        self._stop_for_others(follower, pose, path, aim)
        if blocked:
            self.blocked_place = Point(*path[min(int(free / SPACING), len(path) - 1)].tolist())
        follows = follower.speed > FOLLOWS and self._traffic.is_among_others(pose)
        if blocked and (follows or not self.blocked):
            self.blocked_at = self._clock.time()
        if blocked and not self.blocked:
            self._robot.events.publish(PathBlocked(stamp=self.blocked_at, action=self._action, at=self.blocked_place))
        self.blocked = blocked

    def _stop_for_others(
        self, follower: Follower, pose: Pose, path: NDArray[np.float64], aim: tuple[Point, float]
    ) -> None:
        """Stop for moving objects and robots with right of way, and announce this robot's route."""
        traffic = self._traffic
        way = follower.route.ahead(pose, *aim, ANNOUNCED_MAX) if traffic.needs_whole_way else path
        free = follower.along + traffic.free_distance(path, way, pose, follower.speed, self._planner.radius)
        follower.stop_at = min(follower.stop_at, free)
        traffic.follow(way)

    @property
    def meets(self) -> bool:
        """True if another robot or object is about to cross the route, or has right of way."""
        return self._traffic.meets_others
