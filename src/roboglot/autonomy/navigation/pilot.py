"""One drive to goals: plan, follow, look at every scan, stop before what stands there, plan anew, wait, give up.

Knows poses, scans and the base; no world.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.base_actions import stand_still
from roboglot.autonomy.navigation.course import Course, Goal
from roboglot.autonomy.navigation.follower import PERIOD, Follower
from roboglot.autonomy.navigation.journey import Journey
from roboglot.autonomy.navigation.low_sight import LowSight
from roboglot.autonomy.navigation.narrow import NarrowWatch
from roboglot.autonomy.navigation.route import SPACING
from roboglot.model.actions import Action
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.navigation import NavigationFeedback, Tracks
from roboglot.model.errors import Blocked, NotLocalized, Unreachable
from roboglot.model.events import (
    AnnotationsChanged,
    CorridorEntered,
    Event,
    MapReplaced,
    PathBlocked,
    PoseJumped,
    ScanTaken,
)
from roboglot.model.geometry import STILL, Path, Point, Pose, Twist, wrap_angle

if TYPE_CHECKING:
    from roboglot.autonomy.navigation.planner import Planner
    from roboglot.autonomy.navigation.route import Route

PATIENCE = 30.0  # s without getting closer before it gives up
PATIENCE_ON_TRACKS = 240.0  # … where it must not leave the tracks
GOOD_ENOUGH_SECONDS = 3.0  # s without getting closer after which the tolerance is enough
PROGRESS = 0.1  # m
STUCK_SECONDS, STUCK_SPEED = 3.0, 0.05  # without getting closer at more than this speed (m/s)
REPLAN_PERIOD = 0.5  # s between two plans at least
WAIT_PERIOD = 2.0  # s until the next plan when there was no way
DETOUR, DETOUR_AFTER = 3.0, 4.0  # a way so many m longer than the blocked one is taken only after so many s
DETOURS_MAX = 10  # in one drive
STRAY = 0.4  # m beside the route at which it plans anew
TOUCH_MARGIN, SLOW_MARGIN = 0.015, 0.12  # m beyond the hull within which something is in the way, makes it slow
UNKNOWN_SEAM = 1.0  # m of unknown floor on a way that count as known: the map has holes along its edges
SEARCH_SHARE, SEARCH_MORE = 2.0, 10.0  # times the first way, and m: what it drives at most through unknown floor
HORIZON = 3.0  # m ahead that scans are compared with
WAITING_GAP = 0.4  # m from what blocks the way that count as waiting for it
SCAN_AGE_MAX = 0.5  # s; it does not drive on older scans
LOST_QUALITY, LOST_SECONDS = 0.2, 5.0
FOUND_SECONDS = 15.0  # s of standing still in which a lost place may be found again
THERE, THERE_YAW = 0.015, math.radians(0.5)  # where it brakes
GOOD, GOOD_YAW = 0.025, math.radians(1.0)  # what it must have when it stands
THERE_AHEAD = 0.03  # m, for one that only drives ahead
CORRECTIONS_MAX, CORRECTIONS_AHEAD_MAX = 4, 8
HOLD_GAIN, HOLD_SPEED = 2.0, 0.1  # 1/s, m/s: keeping the place while turning
REPORT_PERIOD = 0.5  # s


DISTRUSTED = (PoseJumped, MapReplaced, AnnotationsChanged)  # events after which the route is planned anew


class Pilot:
    """Made for one action, which holds the base; ``close`` it afterwards."""

    def __init__(
        self,
        course: Course,
        planner: Planner,
        action: Action,
        goal: Goal,
        report: Callable[[NavigationFeedback], None],
        journey: Journey,
    ) -> None:
        self._robot, self._clock, self._belief = course.robot, course.robot.clock, course.belief
        self._course, self._planner, self._action, self._goal = course, planner, action, goal
        self._publish, self._stage = report, ""
        self._journey = journey
        self._patience = PATIENCE if goal.options.tracks is not Tracks.STRICT else PATIENCE_ON_TRACKS
        self._base = self._robot[Base]
        # A differential base cannot correct sideways: it brakes a little earlier and tries more often.
        sideways = self._base.limits.holonomic
        self._there = THERE if sideways else max(THERE, min(THERE_AHEAD, 0.6 * goal.options.tolerance))
        self._corrections = CORRECTIONS_MAX if sideways else CORRECTIONS_AHEAD_MAX
        self._scan_at = -math.inf
        self._follower: Follower | None = None
        self._narrow, self._low = NarrowWatch(planner.radius), LowSight(course.robot)
        self._first = journey.passed  # the goal that the route begins with
        self._plan: asyncio.Task[Route | None] | None = None
        self._planned_at = self._blocked_at = self._reported_at = -math.inf
        self._blocked = self._stale = False
        self._detours = 0
        self._gap = math.inf  # m, the width of the narrowest that it was to pass lately
        self._closest, self._closest_at = math.inf, self._clock.time()
        self._lost_at = math.inf
        self._free_at = self._clock.time()
        events = self._robot.events
        self._listeners = [events.listen(ScanTaken, self._see)]
        self._listeners += [events.listen(kind, self._distrust) for kind in DISTRUSTED]

    def close(self) -> None:
        """Stop listening and planning."""
        for stop in self._listeners:
            stop()
        if self._plan:
            self._plan.cancel()

    async def drive(self) -> None:
        """To all goals in turn and to the final yaw; Unreachable, Blocked or NotLocalized if that fails."""
        await self._first_scan()
        follower = Follower(self._base.limits, self._course.top_speed(self._goal.options), await self._first_route())
        self._follower = follower
        for _ in range(self._corrections):
            await self._follow(follower)
            await stand_still(self._robot)
            follower.halt()
            await self._turn(follower)
            pose, goal, tolerance = self._belief.pose, self._goal.points[-1], self._goal.options.tolerance
            if pose.distance_to(follower.end) <= GOOD or pose.distance_to(goal) <= max(GOOD, tolerance / 2):
                return
        if self._belief.pose.distance_to(self._goal.points[-1]) > self._goal.options.tolerance:
            raise Blocked("cannot settle on the goal")

    # -- what the lidar says -------------------------------------------------------------------------------------------

    def _see(self, event: ScanTaken) -> None:
        scan = self._belief.reader.read(event.scan)
        if not len(scan.points):
            return
        pose = self._belief.map_to_odom.compose(event.odometry)
        points = self._planner.observe(scan, pose, event.stamp)
        low = self._planner.observe_low(self._low.look(), points, pose, event.stamp)
        points = np.concatenate((points, low)) if len(low) else points
        self._scan_at = event.stamp
        if self._follower:
            self._look_ahead(self._follower, pose, points)
            if (width := self._narrow.entered(scan.points)) is not None:
                self._robot.events.publish(CorridorEntered(stamp=event.stamp, action=self._action, width=width))

    def _look_ahead(self, follower: Follower, pose: Pose, points: NDArray[np.float64]) -> None:
        """Find what stands in the way."""
        carrot, beyond = follower.carrot()
        path = follower.route.ahead(pose, carrot, beyond, HORIZON)
        tight = self._planner.free_way(path, points, pose, SLOW_MARGIN)
        if math.isfinite(tight):
            self._gap = follower.route.centre(points, self._planner.radius + SLOW_MARGIN)
            carrot, beyond = follower.carrot()
            path = follower.route.ahead(pose, carrot, beyond, HORIZON)
            tight = self._planner.free_way(path, points, pose, SLOW_MARGIN)
        follower.slow_at = follower.along + tight
        follower.stop_at = follower.along + self._planner.free_way(path, points, pose, TOUCH_MARGIN)
        blocked = math.isfinite(follower.stop_at)
        if blocked and not self._blocked:
            self._blocked_at = event_at = self._clock.time()
            at = Point(*path[min(int((follower.stop_at - follower.along) / SPACING), len(path) - 1)].tolist())
            self._robot.events.publish(PathBlocked(stamp=event_at, action=self._action, at=at))
        self._blocked = blocked

    def _distrust(self, _: Event) -> None:
        self._stale = True

    def _check_place(self) -> None:
        """Raise NotLocalized when it has not known where it is for too long."""
        now = self._clock.time()
        lost = self._belief.localizing and (self._belief.lost is not None or self._belief.quality < LOST_QUALITY)
        self._lost_at = min(self._lost_at, now) if lost else math.inf
        if now - self._lost_at > (LOST_SECONDS if self._belief.lost is None else FOUND_SECONDS):
            why = self._belief.lost or "the scans do not fit the map"
            raise NotLocalized(f"{why} (quality {self._belief.quality:.2f})")

    async def _first_scan(self) -> None:
        deadline = self._clock.time() + PATIENCE
        while self._clock.time() - self._scan_at > SCAN_AGE_MAX:
            if self._clock.time() > deadline:
                raise Blocked("the lidar is silent")
            await self._clock.sleep(PERIOD)

    # -- where to go ---------------------------------------------------------------------------------------------------

    async def _first_route(self) -> Route:
        """The route from here; waits while only what stands around closes the way."""
        begun, published = self._clock.time(), False
        while True:
            await self._action.hold(self._brake)
            route = await self._route(self._goal.points[self._first :])
            if route:
                return route
            self._check_place()
            if self._clock.time() - begun > self._patience:
                raise Blocked(f"the way was blocked for {self._patience:g} s")
            if not published:
                published = True
                self._robot.events.publish(PathBlocked(stamp=self._clock.time(), action=self._action))
            self._journey.waits(self._robot, self._action)
            self._report("waiting", Path(), 0.0)
            await self._clock.sleep(1.0)

    async def _route(self, goals: tuple[Point, ...]) -> Route | None:
        """The way from here; None while something closes it that may go away; Unreachable if that is hopeless."""
        try:
            return await self._known_route(goals)
        except Unreachable:
            if self._belief.in_doubt:
                return None  # that says nothing of the goal
            raise

    async def _known_route(self, goals: tuple[Point, ...]) -> Route | None:
        start, options, rules = self._belief.pose.point, self._goal.options, self._course.drawn
        obstacles, straight, journey = not options.waits, self._goal.straight, self._journey
        try:
            route = await self._course.plan(start, goals, options, obstacles=obstacles, straight=straight)
        except Unreachable:
            if journey.obeyed is not rules:
                await self._course.plan(start, goals, options, obstacles=False)
            if not self._planner.doubt(self._clock.time()):
                return None
            try:
                route = await self._course.plan(start, goals, options, things=False, straight=straight)
            except Unreachable:
                return None
        journey.obeyed = rules if route.unknown <= UNKNOWN_SEAM and route.ends_known else None
        self._bound(route)
        return route

    def _bound(self, route: Route) -> None:
        """Bound the search of a building for a way that may not exist."""
        journey = self._journey
        if route.unknown > UNKNOWN_SEAM and math.isinf(journey.far_max):
            journey.far_max = journey.far + SEARCH_SHARE * route.length + SEARCH_MORE
        if journey.far + route.length > journey.far_max:
            raise Unreachable(f"no way was found through unknown floor within {journey.far_max:.0f} m of driving")

    def _plan_anew(self, follower: Follower) -> None:
        """Begin a new plan when one is needed, and take it when it is there."""
        now = self._clock.time()
        if self._plan:
            if self._plan.done():
                self._take(follower, self._plan)
                self._plan = None
            return
        if now - self._planned_at < REPLAN_PERIOD or not (self._blocked or self._stale or follower.beside > STRAY):
            return
        self._planned_at, self._stale = now, False
        goals = self._goal.points[self._first + follower.passed :]
        self._plan = asyncio.ensure_future(self._route(goals))

    def _take(self, follower: Follower, plan: asyncio.Task[Route | None]) -> None:
        """Change to the planned route if it is better than to go on or wait."""
        route = plan.result()
        if route is None:
            self._planned_at = self._clock.time() + WAIT_PERIOD - REPLAN_PERIOD
            return
        detour = route.length > follower.left + DETOUR
        if detour and self._blocked and self._clock.time() - self._blocked_at < DETOUR_AFTER:
            return
        goals_left = len(self._goal.points) - self._first - follower.passed
        if goals_left != len(route.goals):
            self._stale = True  # a goal was reached meanwhile
            return
        self._first += follower.passed
        follower.take(route)
        if self._blocked:
            follower.stop_at = follower.along  # until the next scan says whether this way is free
        self._blocked = False
        self._closest = route.length  # a new way alone is no progress
        self._detours += detour
        if self._detours > DETOURS_MAX:
            raise Blocked(f"every way was blocked, {DETOURS_MAX} times")

    # -- driving -------------------------------------------------------------------------------------------------------

    def _brake(self) -> None:
        self._base.set_velocity(STILL)

    async def _hold(self, follower: Follower) -> None:
        """Stand while paused."""
        if await self._action.hold(self._brake):
            follower.halt()
            self._closest_at = self._free_at = self._clock.time()
            self._stale = True

    async def _follow(self, follower: Follower) -> None:
        """Drive until close enough to the end to brake."""
        while True:
            await self._hold(follower)
            pose = self._belief.pose
            follower.locate(pose)
            self._journey.far += follower.speed * PERIOD
            self._count(follower, pose)
            away = pose.distance_to(follower.end) if follower.last else math.inf
            if away <= self._there:
                return
            stands = self._clock.time() - self._closest_at
            if self._gives_up(follower):
                raise Blocked(self._why_blocked(follower))
            near = follower.last and pose.distance_to(self._goal.points[-1]) <= self._goal.options.tolerance
            if near and stands > GOOD_ENOUGH_SECONDS:
                return  # something stands in the goal itself
            self._plan_anew(follower)
            if self._clock.time() - self._scan_at > SCAN_AGE_MAX or self._belief.in_doubt:
                follower.stop_at = follower.along
            self._base.set_velocity(follower.command(pose))
            waiting = follower.stop_at - follower.along < WAITING_GAP and follower.speed < 0.05
            if waiting:
                self._journey.waits(self._robot, self._action)
            self._tell(follower, pose, "waiting" if waiting else "driving")
            await self._clock.sleep(PERIOD)

    def _gives_up(self, follower: Follower) -> bool:
        """True if it got no closer for too long; NotLocalized when it does not know where it is."""
        self._check_place()
        now = self._clock.time()
        closer = follower.left < self._closest - PROGRESS
        if closer:
            self._closest, self._closest_at = follower.left, now
            self._journey.since = math.inf
        if closer or follower.speed < STUCK_SPEED:
            self._free_at = now
        elif now - self._free_at > STUCK_SECONDS:
            raise Blocked("the wheels turn, but something that the lidar does not see holds the robot")
        return now - self._closest_at > self._patience

    def _why_blocked(self, follower: Follower) -> str:
        needed = 2.0 * (self._planner.radius + TOUCH_MARGIN)
        narrow = f": a gap is {self._gap:.2f} m wide, {needed:.2f} m are needed" if self._gap < needed else ""
        return f"the way was blocked for {self._patience:g} s, {follower.left:.1f} m before the goal{narrow}"

    async def _turn(self, follower: Follower) -> None:
        """To the final yaw, keeping the place."""
        yaw = self._goal.options.yaw
        if yaw is None:
            return
        begun = self._clock.time()
        while True:
            await self._hold(follower)
            pose = self._belief.pose
            error = wrap_angle(yaw - pose.yaw)
            if abs(error) <= THERE_YAW:
                await stand_still(self._robot)
                follower.halt()
                if abs(wrap_angle(yaw - self._belief.pose.yaw)) <= GOOD_YAW:
                    return
            if self._clock.time() - begun > PATIENCE:
                raise Blocked("cannot turn to the final yaw")
            away = pose.distance_to(follower.end)
            bearing = pose.point.bearing_to(follower.end) - pose.yaw
            speed = min(HOLD_SPEED, HOLD_GAIN * away) if away < 2 * GOOD and self._base.limits.holonomic else 0.0
            self._base.set_velocity(Twist(speed * math.cos(bearing), speed * math.sin(bearing), follower.turn(error)))
            self._tell(follower, pose, "turning")
            await self._clock.sleep(PERIOD)

    # -- feedback ------------------------------------------------------------------------------------------------------

    def _tell(self, follower: Follower, pose: Pose, stage: str) -> None:
        """Report now and then, and whenever the stage changes."""
        now = self._clock.time()
        if stage == self._stage and now - self._reported_at < REPORT_PERIOD:
            return
        self._reported_at = now
        self._report(stage, *self._left(follower, pose))

    def _count(self, follower: Follower, pose: Pose) -> None:
        """Report every goal that was passed, one by one."""
        while self._journey.passed < self._first + follower.passed:
            self._journey.passed += 1
            self._report(self._stage, *self._left(follower, pose))

    def _left(self, follower: Follower, pose: Pose) -> tuple[Path, float]:
        """The way that is left, and the seconds that it takes, roughly."""
        top = self._course.top_speed(self._goal.options)
        seconds = follower.left / (0.7 * top) + top / self._base.limits.linear_acceleration
        return follower.route.remaining(pose, follower.along), seconds

    def _report(self, stage: str, remaining: Path, seconds: float) -> None:
        self._stage = stage
        self._publish(
            NavigationFeedback(
                stage=stage,
                remaining=remaining,
                milestones=self._goal.points[self._journey.passed :],
                time_to_goal=seconds,
            )
        )
