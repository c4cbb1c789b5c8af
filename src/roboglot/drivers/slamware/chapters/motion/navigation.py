"""Navigation by the robot's own planner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.drivers.slamware.chapters.motion.actions import ActionRunner, VendorAction
from roboglot.drivers.slamware.chapters.motion.base import SlamwareBase
from roboglot.drivers.slamware.state import ReportedState
from roboglot.drivers.slamware.vocabulary import location, robot_errors
from roboglot.extras import lazy
from roboglot.model.actions import Action
from roboglot.model.components.motion.navigation import (
    NAVIGATE,
    Navigation,
    NavigationFeedback,
    NavigationOptions,
    Tracks,
    check_goals,
)
from roboglot.model.errors import InvalidGoal, Refused, Unreachable
from roboglot.model.geometry import Path, Point
from roboglot.wire.slamware import geometry
from roboglot.wire.slamware.chapters.motion import (
    ActionInfo,
    MoveFlag,
    MoveOptions,
    MoveToOptions,
    PathQuery,
    SeriesMoveToOptions,
)

if TYPE_CHECKING:
    import numpy as np
else:
    np = lazy("numpy")

GOALS_MAX, PLACES_MAX = 1000, 500
MODES = {Tracks.FREE: 0, Tracks.STRICT: 1, Tracks.PREFERRED: 2}
HERE = 0.5  # m from the robot within which a path may begin: robots plan from their own position
PRECISE = 0.1  # m of tolerance up to which the precise flag is set
TOUR_PASSES = 30


class SlamwareNavigation(Navigation):
    """Navigation by MoveTo and SeriesMoveTo. The robot plans and avoids by itself, even while the link is down."""

    def __init__(
        self, client: SlamwareClient, runner: ActionRunner, reported: ReportedState, base: SlamwareBase
    ) -> None:
        self._client, self._runner, self._reported, self._base = client, runner, reported, base

    def navigate_to(self, goals: Sequence[Point], options: NavigationOptions, *, source: str = "") -> Action:
        check_goals(goals, options, most=GOALS_MAX)
        how = move_options(replace(options, speed_ratio=options.speed_ratio * self._base.share))
        wanted: MoveToOptions | SeriesMoveToOptions
        if len(goals) == 1:
            name, wanted = "MoveToAction", MoveToOptions(location(goals[0]), how)
        else:
            name, wanted = "SeriesMoveToAction", SeriesMoveToOptions([location(goal) for goal in goals], how)
        action = VendorAction(name, wanted, self._feedback)
        return self._runner.start(NAVIGATE, action, goal=tuple(goals), source=source)

    async def plan(self, start: Point, goal: Point) -> Path:
        if start.distance_to(self._reported.pose) > HERE:
            raise Refused("this robot only plans from its present place")
        try:
            with robot_errors():
                found = await self._client.search_path(PathQuery(geometry.Point(goal.x, goal.y)))
        except InvalidGoal as error:
            raise Unreachable(str(error)) from None
        return Path.through(found.path_points)

    async def visiting_order(self, places: Sequence[Point], *, round_trip: bool = False) -> Sequence[int]:
        """Return an order of visits by straight-line distances, as the robot plans only from its own position."""
        if len(places) > PLACES_MAX:
            raise InvalidGoal(f"at most {PLACES_MAX} places, not {len(places)}")
        if not places:
            return []
        from roboglot.kernels.touring import visiting_order  # takes a second to load

        stops = [self._reported.pose.point, *places]
        costs = np.array([[a.distance_to(b) for b in stops] for a in stops])
        order: list[int] = visiting_order(costs, TOUR_PASSES, round_trip).tolist()
        return [number - 1 for number in order[1:]]

    async def _feedback(self, info: ActionInfo) -> NavigationFeedback:
        try:
            remaining = Path.through((await self._client.get_remaining_path()).path_points)
            milestones = (await self._client.get_remaining_milestones()).path_points
            seconds = await self._client.get_remaining_time()
        except SlamwareRefused:  # there is no path at the moment
            return NavigationFeedback(stage="planning", remaining=Path(), milestones=(), time_to_goal=0.0)
        return NavigationFeedback(
            stage="driving" if remaining.points else "planning",
            remaining=remaining,
            milestones=tuple(Point(x, y) for x, y in milestones),
            time_to_goal=seconds,
        )


def move_options(options: NavigationOptions) -> MoveOptions:
    """Return the options in the form of the API."""
    flags: list[MoveFlag | None] = []
    if options.yaw is not None:
        flags.append("with_yaw")
    if options.tolerance <= PRECISE:
        flags.append("precise")
    if options.retries:
        flags.append("fail_retry_count")
    if options.waits:
        flags.append("find_path_ignoring_dynamic_obstacles")
    return MoveOptions(
        mode=MODES[options.tracks],
        flags=flags,
        yaw=options.yaw,
        acceptable_precision=options.tolerance,
        fail_retry_count=options.retries or None,
        speed_ratio=options.speed_ratio,
    )
