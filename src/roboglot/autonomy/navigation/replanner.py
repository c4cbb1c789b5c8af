"""Routes of a drive: the first one, and new ones when the path is blocked, distrusted or left."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING

from roboglot.autonomy.navigation.context import Goal, NavigationContext
from roboglot.autonomy.navigation.drive_progress import DriveProgress
from roboglot.autonomy.navigation.follower import Follower
from roboglot.autonomy.navigation.path_monitor import PathMonitor
from roboglot.model.errors import Blocked, Unreachable
from roboglot.model.events import AnnotationsChanged, Event, MapReplaced, PoseJumped
from roboglot.model.geometry import Point

if TYPE_CHECKING:
    from roboglot.autonomy.navigation.planner import Planner
    from roboglot.autonomy.navigation.route import Route

DISTRUSTED = (PoseJumped, MapReplaced, AnnotationsChanged)  # events after which the route is planned again


class Replanner:
    """Planner in the background of a drive, one plan at a time; ``close`` it afterwards."""

    def __init__(
        self,
        context: NavigationContext,
        planner: Planner,
        goal: Goal,
        drive_progress: DriveProgress,
        path_monitor: PathMonitor,
    ) -> None:
        self._context, self._planner, self._goal, self._drive_progress = context, planner, goal, drive_progress
        self._clock, self._tuning, self._path_monitor = context.robot.clock, context.tuning, path_monitor
        self._first = drive_progress.passed  # the goal with which the route begins
        self._plan: asyncio.Task[Route | None] | None = None
        self._planned_at = -math.inf
        self._stale = self._polite = False  # the plan only leads around other robots
        self._around = False  # … only around the obstacle in the way
        self._detours = self._arounds = self._at_goal = 0
        self._at_goal_since = math.inf
        events = context.robot.events
        self._listeners = [events.listen(kind, self._distrust) for kind in DISTRUSTED]

    def close(self) -> None:
        """Stop listening and planning."""
        for stop in self._listeners:
            stop()
        if self._plan:
            self._plan.cancel()

    def distrust(self) -> None:
        """Plan again as soon as possible."""
        self._stale = True

    def _distrust(self, _: Event) -> None:
        self.distrust()

    def passed(self, follower: Follower) -> int:
        """Return the number of the drive's goals that have been passed."""
        return self._first + follower.passed

    def begin_again(self, follower: Follower) -> None:
        """Let the next ``first`` begin with the follower's present goal."""
        self._first += follower.passed
        self._stale = False

    async def first(self) -> Route | None:
        """Plan from here through all remaining goals; see ``_route``."""
        return await self._route(self._goal.points[self._first :])

    async def _route(self, goals: tuple[Point, ...]) -> Route | None:
        """Return a route from here; None while obstacles close it that may go away. Raises Unreachable."""
        try:
            return await self._known_route(goals)
        except Unreachable:
            if self._context.belief.in_doubt:
                return None  # that does not concern the goal
            raise

    async def _known_route(self, goals: tuple[Point, ...]) -> Route | None:
        """Return a route around obstacles, else one without isolated things, which may be gone; None: wait.

        Raises Unreachable if the map alone, without obstacles, shows that there is none.
        """
        context, options, rules = self._context, self._goal.options, self._context.drawn
        start, straight, drive_progress = context.belief.pose.point, self._goal.straight, self._drive_progress
        try:
            route = await context.plan(start, goals, options, obstacles=not options.waits, straight=straight)
        except Unreachable:
            if drive_progress.obeyed is not rules:
                await context.plan(start, goals, options, obstacles=False)
            if not self._planner.doubt(self._clock.time()):
                return None
            try:
                route = await context.plan(start, goals, options, things=False, straight=straight)
            except Unreachable:
                return None
        if await self._closed_for_now(route, start, goals):
            return None
        drive_progress.obeyed = rules if self._is_known(route) else None
        self._bound(route)
        return route

    async def _closed_for_now(self, route: Route, start: Point, goals: tuple[Point, ...]) -> bool:
        """Return whether ``route`` leads through unknown floor only because an obstacle is on a known or shorter way.

        A robot or a person may leave: for a while, waiting is better than searching the building.
        """
        drive_progress, now = self._drive_progress, self._clock.time()
        if self._is_known(route):
            drive_progress.closed_since = math.inf
            return False
        if drive_progress.obeyed is not self._context.drawn:  # otherwise there was one earlier in this drive
            try:
                known = await self._context.plan(start, goals, self._goal.options, obstacles=False)
            except Unreachable:
                return False
            if not self._is_known(known) and not self._would_leave(route.length - known.length):
                return False
        drive_progress.closed_since = min(drive_progress.closed_since, now)
        return now - drive_progress.closed_since < self._tuning.search_after

    def _would_leave(self, more: float) -> bool:
        """True if a way that is ``more`` m shorter may become free: others are near, or had no time to move yet."""
        context, drive_progress = self._context, self._drive_progress
        if more <= self._tuning.detour:
            return False
        looked = self._clock.time() - min(drive_progress.closed_since, self._clock.time())
        return looked < self._tuning.look_first or context.traffic.is_among_others(context.belief.pose)

    def _is_known(self, route: Route) -> bool:
        return route.unknown <= self._tuning.unknown_seam and route.ends_known

    def _bound(self, route: Route) -> None:
        """Limit the search through unknown floor for a way that may not exist. Raises Unreachable."""
        drive_progress, tuning = self._drive_progress, self._tuning
        if route.unknown > tuning.unknown_seam and math.isinf(drive_progress.far_max):
            drive_progress.far_max = drive_progress.far + tuning.search_share * route.length + tuning.search_more
        if drive_progress.far + route.length > drive_progress.far_max:
            raise Unreachable(
                f"no way was found through unknown floor within {drive_progress.far_max:.0f} m of driving"
            )

    def advance(self, follower: Follower) -> bool:
        """Begin a new plan if needed; return whether ``follower`` got another route. Raises Blocked, Unreachable."""
        now, tuning, path_monitor = self._clock.time(), self._tuning, self._path_monitor
        if self._plan:
            if not self._plan.done():
                return False
            taken = self._take(follower, self._plan)
            self._plan = None
            return taken
        needed = path_monitor.blocked or self._stale or follower.beside > tuning.stray
        polite = not needed and path_monitor.meets
        period = tuning.polite_period if polite else tuning.replan_period
        if now - self._planned_at >= period and (needed or polite):
            self._around = path_monitor.blocked and not self._stale and follower.beside <= tuning.stray
            self._polite, self._planned_at, self._stale = polite, now, False
            self._plan = asyncio.ensure_future(self._route(self._goal.points[self.passed(follower) :]))
        return False

    def _take(self, follower: Follower, plan: asyncio.Task[Route | None]) -> bool:
        """Change to the planned route if it is better than the present one or waiting; return whether it was."""
        route, path_monitor, tuning = plan.result(), self._path_monitor, self._tuning
        if route is None:
            self._planned_at = self._clock.time() + tuning.wait_period - tuning.replan_period
            return False
        pose, more = self._context.belief.pose, route.length - follower.left
        cost = more / tuning.others_pace + follower.turning(pose, route)
        if self._polite and (more > tuning.around or cost > self._leaves(follower)):
            return False  # waiting takes less time
        if self._around and not path_monitor.blocked and more > tuning.around:
            return False  # the obstacle has left
        detour = more > tuning.detour
        if path_monitor.blocked and self._clock.time() - path_monitor.blocked_at < self._bears(follower, more, cost):
            return False
        if len(self._goal.points) - self.passed(follower) != len(route.goals):
            self._stale = True  # a goal was reached meanwhile
            return False
        around = path_monitor.blocked and route.length > follower.left + tuning.around
        self._count(detour, around=around)
        if around and not self._context.traffic.is_blocked_by_others(path_monitor.blocked_place):
            self._check_goal(self._goal.points[self.passed(follower)])
        self._first += follower.passed
        follower.take(route)
        if path_monitor.blocked:
            follower.stop_at = follower.along  # until the next scan shows whether this route is free
        path_monitor.blocked = False
        return True

    def _leaves(self, follower: Follower) -> float:
        """Return the time until others are expected to have left the way ahead, s; inf: they stand or come along it."""
        carrot, beyond = follower.carrot()
        path = follower.route.ahead(self._context.belief.pose, carrot, beyond, self._tuning.horizon)
        return self._context.traffic.seconds_until_clear(path)

    def _bears(self, follower: Follower, more: float, cost: float) -> float:
        """Return the time to wait before an obstacle until a way ``more`` m and ``cost`` s longer is taken, s."""
        tuning, traffic, place = self._tuning, self._context.traffic, self._path_monitor.blocked_place
        if traffic.is_blocked_by_others(place, moving=True) and self._leaves(follower) < cost:
            return tuning.others_after
        if more <= tuning.detour:
            return 0.0
        if not traffic.is_blocked_by_others(place):
            return tuning.detour_after
        return max(tuning.detour_after, min(tuning.others_after, more / tuning.others_pace))

    def is_too_long(self, route: Route, left: float, waited: float) -> bool:
        """True if ``route`` is much longer than the ``left`` m before, and others may still leave the shorter way."""
        more, tuning = route.length - left, self._tuning
        if more <= tuning.detour or not self._context.traffic.is_among_others(self._context.belief.pose):
            return False
        return waited < min(tuning.others_after, more / tuning.others_pace)

    def _count(self, detour: bool, *, around: bool) -> None:
        """Limit the number of route changes. Raises Blocked."""
        self._detours += detour
        self._arounds += around
        if self._detours > self._tuning.detours_max or self._arounds > self._tuning.arounds_max:
            raise Blocked(f"every way was blocked, {max(self._detours, self._arounds) - 1} times")

    def _check_goal(self, goal: Point) -> None:
        """Raise Blocked for a goal that is blocked from all sides: the map shows only sides that the robot sees."""
        now, tuning = self._clock.time(), self._tuning
        if self._path_monitor.blocked_place.distance_to(goal) > tuning.at_goal:
            self._at_goal, self._at_goal_since = 0, math.inf
            return
        self._at_goal, self._at_goal_since = self._at_goal + 1, min(self._at_goal_since, now)
        if self._at_goal > tuning.at_goal_max and now - self._at_goal_since > tuning.patience:
            raise Blocked(f"an obstacle stands on the goal: {self._at_goal - 1} ways around it were blocked")
