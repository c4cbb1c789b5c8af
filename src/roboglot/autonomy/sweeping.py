"""Sweeping on the map: the component. Where the lanes lie is lanes.py's, each drive is navigation's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from roboglot.autonomy.base_actions import start_on_base
from roboglot.autonomy.course import Course, Goal
from roboglot.autonomy.lanes import Part, parts, zigzag
from roboglot.autonomy.navigation import GridNavigation
from roboglot.model.actions import Action, OnBusy
from roboglot.model.components.annotations import Area, AreaKind
from roboglot.model.components.localization import Localization
from roboglot.model.components.navigation import NavigationFeedback, NavigationOptions
from roboglot.model.components.sweeping import SweepFeedback, Sweeping
from roboglot.model.errors import Blocked, InvalidGoal, Unreachable
from roboglot.model.geometry import Point
from roboglot.model.robot import Robot

OVERLAP = 0.85  # of the hull's width between two lanes
WIDTH_MIN, WIDTH_MAX = 0.1, 5.0  # m
AREAS_MAX = 200
TOLERANCE = 0.15  # m at the ends of the lanes
GOALS_AT_ONCE = 40
PASSES = 30  # of improving the order of the parts


class LaneSweeping(Sweeping):
    """Parts in a short order, lanes to and fro; what cannot be reached is left out and told."""

    def __init__(self, robot: Robot, course: Course, navigation: GridNavigation) -> None:
        self._robot, self._course, self._navigation = robot, course, navigation

    def sweep(
        self,
        areas: Sequence[Area] = (),
        *,
        width: float | None = None,
        source: str = "",
        on_busy: OnBusy = OnBusy.REPLACE,
    ) -> Action:
        wanted, apart = self._checked(areas, width)

        async def run(action: Action) -> None:
            await self._run(action, await self._ways(wanted, apart))

        return start_on_base(self._robot, "sweep", run, goal=wanted, source=source, on_busy=on_busy)

    async def lanes(self, areas: Sequence[Area] = (), *, width: float | None = None) -> Sequence[Sequence[Point]]:
        return await self._ways(*self._checked(areas, width))

    def _checked(self, areas: Sequence[Area], width: float | None) -> tuple[tuple[Area, ...], float]:
        wanted = tuple(areas) or self._course.drawn.areas_of(AreaKind.COVERAGE)
        if not 0 < len(wanted) <= AREAS_MAX:
            raise InvalidGoal("no area to sweep is drawn on the map" if not wanted else f"more than {AREAS_MAX} areas")
        numbers = [v for a in wanted for v in (a.start.x, a.start.y, a.end.x, a.end.y, a.half_width)]
        if not all(map(math.isfinite, numbers)):
            raise InvalidGoal("an area lies nowhere")
        apart = 2 * OVERLAP * self._robot.description.radius if width is None else width
        if not WIDTH_MIN <= apart <= WIDTH_MAX:
            raise InvalidGoal(f"lanes lie {WIDTH_MIN} to {WIDTH_MAX} m apart, not {apart}")
        return wanted, apart

    async def _ways(self, areas: Sequence[Area], width: float) -> list[list[Point]]:
        """The lanes' ends of every part, the parts in a short order from here."""
        from roboglot.kernels.touring import visiting_order

        here = self._robot[Localization].pose.point
        floor, frame = await self._course.open_floor(here)
        found: list[Part] = [part for area in areas for part in parts(area, floor, frame, width)]
        middles = [here, *(part[len(part) // 2].start for part in found)]
        costs = np.array([[a.distance_to(b) for b in middles] for a in middles])
        ways: list[list[Point]] = []
        for number in visiting_order(costs, PASSES, False).tolist()[1:]:
            ways.append(zigzag(found[number - 1], ways[-1][-1] if ways else here))
        return ways

    async def _run(self, action: Action, ways: Sequence[Sequence[Point]]) -> None:
        total, done, left_out = sum(map(_length, ways)), 0.0, 0.0
        if not ways:
            raise Unreachable("there is no open floor to sweep")
        for way in ways:
            for first in range(0, len(way), GOALS_AT_ONCE):
                piece = way[first : first + GOALS_AT_ONCE]
                action.report(SweepFeedback(done, total, left_out))
                try:
                    goal = Goal(tuple(piece), NavigationOptions(tolerance=TOLERANCE))
                    await self._navigation.drive(action, goal, _unheard)
                    done += _length(piece)
                except (Unreachable, Blocked):
                    left_out += _length(piece)
        action.report(SweepFeedback(done, total, left_out))
        if done == 0.0 < left_out:
            raise Unreachable("no way led to any lane")


def _length(way: Sequence[Point]) -> float:
    return sum(a.distance_to(b) for a, b in pairwise(way))


def _unheard(_: NavigationFeedback) -> None:
    """The feedback of sweeping has its own words."""
