"""One drive to goals: set out, follow the route, turn, and repeat until the goal is reached; or give up.

Knows poses and the base, no world. path_monitor.py evaluates scans, replanner.py chooses routes, progress_checker.py
decides when to give up.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum, auto
from typing import TYPE_CHECKING

from roboglot.autonomy.navigation.base_actions import stand_still
from roboglot.autonomy.navigation.context import Goal, NavigationContext
from roboglot.autonomy.navigation.drive_progress import DriveProgress
from roboglot.autonomy.navigation.follower import PERIOD, Follower
from roboglot.autonomy.navigation.path_monitor import PathMonitor
from roboglot.autonomy.navigation.progress_checker import ProgressChecker
from roboglot.autonomy.navigation.replanner import Replanner
from roboglot.autonomy.traffic.giving_way import GivingWay
from roboglot.model.actions import Action
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.navigation import NavigationFeedback
from roboglot.model.errors import Blocked
from roboglot.model.events import PathBlocked
from roboglot.model.geometry import STILL, Path, Pose, Twist, wrap_angle

if TYPE_CHECKING:
    from roboglot.autonomy.navigation.planner import Planner
    from roboglot.autonomy.navigation.route import Route

FIRST_ROUTE_PERIOD = 1.0  # s between two attempts to find any route
WAITING_SPEED = 0.05  # m/s below which a robot in front of an obstacle counts as waiting
CRUISE_SHARE = 0.7  # of the top speed that a long drive averages


class State(Enum):
    """State of the pilot; each leads to the next, ARRIVING back to FOLLOWING if the robot is too far off."""

    FOLLOWING = auto()
    GIVING_WAY = auto()
    TURNING = auto()
    ARRIVING = auto()
    DONE = auto()


class Pilot:
    """Pilot of one action, which holds the base; ``close`` it afterwards."""

    def __init__(
        self,
        context: NavigationContext,
        planner: Planner,
        action: Action,
        goal: Goal,
        report: Callable[[NavigationFeedback], None],
        drive_progress: DriveProgress,
    ) -> None:
        self._robot, self._clock, self._belief = context.robot, context.robot.clock, context.belief
        self._traffic = context.traffic
        self._tuning, self._base = context.tuning, context.robot[Base]
        self._action, self._goal, self._drive_progress = action, goal, drive_progress
        self._publish, self._stage, self._reported_at = report, "", -math.inf
        self._path_monitor = PathMonitor(context, planner, action)
        self._replanner = Replanner(context, planner, goal, drive_progress, self._path_monitor)
        self._giving_way = GivingWay(context, self._path_monitor, action)
        patience = self._tuning.patience_for(goal.options.tracks)
        self._progress = ProgressChecker(self._clock, self._belief, self._tuning, patience)
        self._top = context.top_speed(goal.options)
        holonomic = self._base.limits.holonomic
        self._there = self._tuning.there_for(goal.options.tolerance, holonomic=holonomic)
        self._tries_left = self._tuning.corrections_for(holonomic=holonomic)

    def close(self) -> None:
        """Stop listening and planning."""
        self._path_monitor.close()
        self._traffic.rest()
        self._replanner.close()

    async def drive(self) -> None:
        """Drive to all goals in turn and to the final yaw. Raises Unreachable, Blocked or NotLocalized."""
        steps = {
            State.FOLLOWING: self._follow,
            State.GIVING_WAY: self._give_way,
            State.TURNING: self._turn,
            State.ARRIVING: self._arrive,
        }
        follower = await self._set_out()
        state = State.FOLLOWING
        while state is not State.DONE:
            state = await steps[state](follower)

    # -- the states --

    async def _set_out(self) -> Follower:
        """Wait for a scan and a route. Raises Blocked, Unreachable, NotLocalized."""
        await self._path_monitor.first_scan()
        follower = Follower(self._base.limits, self._top, await self._first_route())
        self._path_monitor.follower = follower
        return follower

    async def _first_route(self, left: float = math.inf) -> Route:
        """Return a route from here; wait while obstacles close every route, or a much shorter one of ``left`` m."""
        begun, published = self._clock.time(), False
        while True:
            await self._action.hold(self._brake)
            route = await self._replanner.first()
            if route and not self._replanner.is_too_long(route, left, self._clock.time() - begun):
                return route
            self._progress.check_place()
            if self._clock.time() - begun > self._progress.seconds:
                raise Blocked(f"the way was blocked for {self._progress.seconds:g} s")
            if not published:
                published = True
                self._robot.events.publish(PathBlocked(stamp=self._clock.time(), action=self._action))
            self._drive_progress.waits(self._robot, self._action)
            self._report("waiting", Path(), 0.0)
            if self._giving_way.is_due_without_route():
                left += await self._giving_way.go_aside(self._top)
            await self._clock.sleep(FIRST_ROUTE_PERIOD)

    async def _follow(self, follower: Follower) -> State:
        """Drive until close enough to the end, and brake."""
        state = State.FOLLOWING

        def step() -> float | None:
            nonlocal state
            if not (paused := self._action.paused):
                state = self._step(follower)
            return PERIOD if state is State.FOLLOWING and not paused else None

        while state is State.FOLLOWING:
            await self._hold(follower)
            await self._clock.keep_calling(step)
        if state is State.TURNING:
            await stand_still(self._robot)
            follower.halt()
        return state

    def _step(self, follower: Follower) -> State:
        """Set the base's velocity for the next period; return the state that follows. Raises Blocked, NotLocalized."""
        pose = self._belief.pose
        if self._is_over(follower, pose):
            return State.TURNING
        if self._replanner.advance(follower):
            self._progress.take(follower.left)
        if not self._path_monitor.monitors(follower) or self._belief.in_doubt:
            follower.stop_at = follower.along
        self._base.set_velocity(follower.command(pose))
        waiting = follower.stop_at - follower.along < self._tuning.waiting_gap and follower.speed < WAITING_SPEED
        if waiting:
            self._drive_progress.waits(self._robot, self._action)
        self._report_progress(follower, pose, "waiting" if waiting else "driving")
        return State.GIVING_WAY if self._giving_way.is_due(follower) else State.FOLLOWING

    async def _give_way(self, follower: Follower) -> State:
        """Move aside, wait there, and set out again."""
        self._report("waiting", Path(), 0.0)
        aside = await self._giving_way.give_way(follower)
        self._replanner.begin_again(follower)
        follower.take(await self._first_route(follower.left + aside))
        self._path_monitor.follower = follower  # the robot may have given way again meanwhile, along another route
        self._progress.take(follower.left)
        self._progress.restart()
        return State.FOLLOWING

    def _is_over(self, follower: Follower, pose: Pose) -> bool:
        """Return whether to brake at the end of the route. Raises Blocked or NotLocalized to give up."""
        progress, tuning = self._progress, self._tuning
        follower.locate(pose)
        self._drive_progress.far += follower.speed * PERIOD
        self._count(follower, pose)
        if follower.last and pose.distance_to(follower.end) <= self._there:
            return True
        stood = progress.stood
        progress.check_place()
        if progress.look(follower):
            self._drive_progress.since = math.inf
        if progress.spent:
            where = f"{follower.left:.1f} m before the goal{self._path_monitor.gap_message}"
            raise Blocked(f"the way was blocked for {progress.seconds:g} s, {where}")
        if stood <= tuning.good_enough_seconds or not self._is_near(follower, pose):
            return False
        if follower.last:
            return True
        follower.pass_goal()
        return False

    def _is_near(self, follower: Follower, pose: Pose) -> bool:
        """True within the tolerance of the next goal, which is near enough for an occupied goal."""
        goal = self._goal.points[self._replanner.passed(follower)]
        return pose.distance_to(goal) <= self._goal.options.tolerance

    async def _turn(self, follower: Follower) -> State:
        """Turn to the final yaw on the spot. Raises Blocked."""
        yaw, tuning = self._goal.options.yaw, self._tuning
        if yaw is None:
            return State.ARRIVING
        begun = self._clock.time()
        while True:
            await self._hold(follower)
            pose = self._belief.pose
            error = wrap_angle(yaw - pose.yaw)
            if abs(error) <= tuning.there_yaw:
                await stand_still(self._robot)
                follower.halt()
                if abs(wrap_angle(yaw - self._belief.pose.yaw)) <= tuning.good_yaw:
                    return State.ARRIVING
            if self._clock.time() - begun > tuning.patience:
                raise Blocked("cannot turn to the final yaw")
            self._base.set_velocity(self._turning(follower, pose, error))
            self._report_progress(follower, pose, "turning")
            await self._clock.sleep(PERIOD)

    def _turning(self, follower: Follower, pose: Pose, error: float) -> Twist:
        """Return the twist that reduces ``error`` (rad) and, for a holonomic base, keeps the place."""
        tuning, away = self._tuning, pose.distance_to(follower.end)
        bearing = pose.point.bearing_to(follower.end) - pose.yaw
        keeps = away < 2 * tuning.good and self._base.limits.holonomic
        speed = min(tuning.hold_speed, tuning.hold_gain * away) if keeps else 0.0
        return Twist(speed * math.cos(bearing), speed * math.sin(bearing), follower.turn(error))

    async def _arrive(self, follower: Follower) -> State:
        """Check the final pose once it is certain: accept it, try again, or raise Blocked."""
        await self._progress.be_certain(self._goal.options.tolerance)
        pose, goal, options = self._belief.pose, self._goal.points[-1], self._goal.options
        good, tolerance = self._tuning.good, options.tolerance
        faces = options.yaw is None or abs(wrap_angle(options.yaw - pose.yaw)) <= self._tuning.good_yaw
        if faces and (pose.distance_to(follower.end) <= good or pose.distance_to(goal) <= max(good, tolerance / 2)):
            return State.DONE
        self._tries_left -= 1
        if self._tries_left > 0:
            return State.FOLLOWING
        if not faces or pose.distance_to(goal) > tolerance:
            raise Blocked("cannot settle on the goal")
        return State.DONE

    def _brake(self) -> None:
        self._base.set_velocity(STILL)

    async def _hold(self, follower: Follower) -> None:
        """Stand while paused."""
        if await self._action.hold(self._brake):
            follower.halt()
            self._progress.restart()
            self._replanner.distrust()

    # -- feedback --

    def _report_progress(self, follower: Follower, pose: Pose, stage: str) -> None:
        """Report progress periodically, and whenever the stage changes."""
        now = self._clock.time()
        if stage == self._stage and now - self._reported_at < self._tuning.report_period:
            return
        self._reported_at = now
        self._report(stage, *self._left(follower, pose))

    def _count(self, follower: Follower, pose: Pose) -> None:
        """Report the passed goals one by one."""
        while self._drive_progress.passed < self._replanner.passed(follower):
            self._drive_progress.passed += 1
            self._report(self._stage, *self._left(follower, pose))

    def _left(self, follower: Follower, pose: Pose) -> tuple[Path, float]:
        """Return the remaining path (map), and its estimated time, s."""
        seconds = follower.left / (CRUISE_SHARE * self._top) + self._top / self._base.limits.linear_acceleration
        return follower.route.remaining(pose, follower.along), seconds

    def _report(self, stage: str, remaining: Path, seconds: float) -> None:
        self._stage = stage
        self._publish(
            NavigationFeedback(
                stage=stage,
                remaining=remaining,
                milestones=self._goal.points[self._drive_progress.passed :],
                time_to_goal=seconds,
            )
        )
