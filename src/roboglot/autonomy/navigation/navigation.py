"""The navigation component: goals, retries, tours. Each drive is a pilot's (pilot.py)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.computing import computed
from roboglot.autonomy.navigation.base_actions import start_on_base
from roboglot.autonomy.navigation.context import Goal, NavigationContext
from roboglot.autonomy.navigation.drive_progress import DriveProgress
from roboglot.autonomy.navigation.pilot import Pilot
from roboglot.model.actions import Action
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import abort_with_map
from roboglot.model.components.motion.navigation import (
    NAVIGATE,
    Navigation,
    NavigationFeedback,
    NavigationOptions,
    check_goals,
)
from roboglot.model.errors import Blocked, Unreachable
from roboglot.model.events import MapReplaced
from roboglot.model.geometry import ORIGIN, Path, Point
from roboglot.model.robot import Robot

GOALS_MAX = 500
RETRY_AFTER = 5.0  # s
TOUR_PASSES = 30  # of improving a tour
NO_WAY = 1e6  # m
NEAR = 0.5  # m from a stop that count as reached, in a tour


class GridNavigation(Navigation):
    """Navigation on the grid map; drives wait for estimator and planner."""

    def __init__(self, robot: Robot, context: NavigationContext) -> None:
        self._robot = robot
        self._context = context

    def navigate_to(self, goals: Sequence[Point], options: NavigationOptions, *, source: str = "") -> Action:
        goal = _checked(goals, options)
        self._context.check_available()

        async def run(action: Action) -> None:
            await self._drive(action, goal, action.report, DriveProgress())

        return abort_with_map(self._robot, start_on_base(self._robot, NAVIGATE, run, goal=goal, source=source))

    async def drive(
        self,
        action: Action,
        goal: Goal,
        report: Callable[[NavigationFeedback], None] | None = None,
        drive_progress: DriveProgress | None = None,
    ) -> None:
        """Drive to the goals, with retries, within an action that holds the base. Raises Blocked, Unreachable.

        ``report`` gets the progress; None for actions that report their own. ``drive_progress`` counts goals passed,
        even if the drive fails. The action is aborted if the map is replaced: on another map the goals are elsewhere.
        """

        def check_map(event: MapReplaced) -> None:
            if event.origin != ORIGIN:
                action.abort(Unreachable("the map was replaced, and with it the goal's place"))

        end_watch = self._robot.events.listen(MapReplaced, check_map)
        try:
            await self._drive(action, goal, report or _unheard, drive_progress or DriveProgress())
        finally:
            end_watch()

    async def _drive(
        self, action: Action, goal: Goal, report: Callable[[NavigationFeedback], None], drive_progress: DriveProgress
    ) -> None:
        tries_left = goal.options.retries
        while True:
            try:
                await self._attempt(action, goal, report, drive_progress)
                return
            except (Blocked, Unreachable):
                if tries_left == 0:
                    raise
                tries_left -= 1
            await self._robot.clock.sleep(RETRY_AFTER)

    async def _attempt(
        self, action: Action, goal: Goal, report: Callable[[NavigationFeedback], None], drive_progress: DriveProgress
    ) -> None:
        left = goal.points[drive_progress.passed :]
        report(NavigationFeedback(stage="planning", remaining=Path(), milestones=left, time_to_goal=0.0))
        pilot = Pilot(self._context, await self._context.ready(), action, goal, report, drive_progress)
        try:
            await pilot.drive()
        finally:
            pilot.close()

    async def plan(self, start: Point, goal: Point) -> Path:
        _checked((start, goal), NavigationOptions())
        route = await self._context.plan(start, (goal,), NavigationOptions())
        return Path.through([(x, y) for x, y in route.vertices.tolist()])

    async def visiting_order(self, places: Sequence[Point], *, round_trip: bool = False) -> Sequence[int]:
        if not places:
            return []
        _checked(places, NavigationOptions())
        await self._context.ready()  # the kernels are loaded from here on
        from roboglot.kernels.touring import EXACT_MAX, visiting_order

        stops = (self._robot[Localization].pose.point, *places)
        costs = await (self._lengths(stops) if len(places) <= EXACT_MAX else self._context.lengths(stops, NEAR))
        if round_trip and not np.isfinite(costs).all():
            raise Unreachable("one of the places is unreachable")
        straight = np.array([[a.distance_to(b) for b in stops] for a in stops])
        costs = np.where(np.isfinite(costs), costs, NO_WAY + straight)
        work = partial(visiting_order, np.ascontiguousarray(costs), TOUR_PASSES, round_trip)
        order: list[int] = (await computed(self._robot.clock, work)).tolist()
        return [number - 1 for number in order[1:]]

    async def _lengths(self, stops: Sequence[Point]) -> NDArray[np.float64]:
        """Return the lengths of the routes between all pairs of stops, m; inf: unreachable."""
        lengths = np.zeros((len(stops), len(stops)))
        for a, b in combinations(range(len(stops)), 2):
            lengths[a, b] = lengths[b, a] = await self._way_length(stops[a], stops[b])
        return lengths

    async def _way_length(self, start: Point, goal: Point) -> float:
        """Return the length of the route to ``goal``, m; inf: unreachable."""
        if start.distance_to(goal) == 0.0:
            return 0.0
        try:
            return (await self._context.plan(start, (goal,), NavigationOptions(tolerance=NEAR))).length
        except Unreachable:
            return math.inf


def _unheard(_: NavigationFeedback) -> None:
    """Ignore the progress of a drive."""


def _checked(goals: Sequence[Point], options: NavigationOptions) -> Goal:
    """Return the goal. Raises InvalidGoal."""
    check_goals(goals, options, most=GOALS_MAX)
    return Goal(tuple(Point(goal.x, goal.y) for goal in goals), options)
