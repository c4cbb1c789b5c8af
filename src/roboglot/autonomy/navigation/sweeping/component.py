"""The sweeping component: lanes come from lanes.py, drives are navigation's."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from roboglot.autonomy.navigation.base_actions import start_on_base
from roboglot.autonomy.navigation.context import Goal, NavigationContext
from roboglot.autonomy.navigation.drive_progress import DriveProgress
from roboglot.autonomy.navigation.navigation import GridNavigation
from roboglot.autonomy.navigation.sweeping.lanes import Stretch, all_parts, open_stretches, zigzag
from roboglot.autonomy.navigation.sweeping.swept import Swept
from roboglot.model.actions import Action
from roboglot.model.components.mapping.annotations import Area, AreaKind
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import abort_with_map
from roboglot.model.components.motion.navigation import NavigationOptions
from roboglot.model.components.motion.sweeping import Sweeping
from roboglot.model.errors import Blocked, InvalidGoal, Unreachable
from roboglot.model.geometry import Point
from roboglot.model.robot import Robot

OVERLAP = 0.85  # of the hull's width between two lanes
WIDTH_MIN, WIDTH_MAX = 0.1, 5.0  # m
AREAS_MAX = 200
TOLERANCE = 0.05  # m at the ends of the lanes
LANES_AT_ONCE = 20  # per drive
PASSES = 30  # of improving the order of the parts


class LaneSweeping(Sweeping):
    """Sweeping part by part in a short order, lanes to and fro; unreachable lanes are left out and reported."""

    def __init__(self, robot: Robot, context: NavigationContext, navigation: GridNavigation) -> None:
        self._robot, self._context, self._navigation = robot, context, navigation

    def sweep(self, areas: Sequence[Area] = (), *, width: float | None = None, source: str = "") -> Action:
        wanted, apart = self._checked(areas, width)

        async def run(action: Action) -> None:
            await self._run(action, await self._ways(wanted, apart))

        return abort_with_map(self._robot, start_on_base(self._robot, "sweep", run, goal=wanted, source=source))

    async def lanes(self, areas: Sequence[Area] = (), *, width: float | None = None) -> Sequence[Sequence[Point]]:
        return await self._ways(*self._checked(areas, width))

    def _checked(self, areas: Sequence[Area], width: float | None) -> tuple[tuple[Area, ...], float]:
        wanted = tuple(areas) or self._context.drawn.areas_of(AreaKind.COVERAGE)
        if not 0 < len(wanted) <= AREAS_MAX:
            raise InvalidGoal("no area to sweep is drawn on the map" if not wanted else f"more than {AREAS_MAX} areas")
        numbers = [v for a in wanted for v in (a.start.x, a.start.y, a.end.x, a.end.y, a.half_width)]
        if not all(map(math.isfinite, numbers)):
            raise InvalidGoal("an area has no finite coordinates")
        apart = 2 * OVERLAP * self._robot.description.radius if width is None else width
        if not WIDTH_MIN <= apart <= WIDTH_MAX:
            raise InvalidGoal(f"lanes must be {WIDTH_MIN} to {WIDTH_MAX} m apart, not {apart}")
        return wanted, apart

    async def _ways(self, areas: Sequence[Area], width: float) -> list[list[Point]]:
        """Return the ends of the lanes (map) by part, the parts in a short order from here."""
        from roboglot.kernels.touring import visiting_order

        here = self._robot[Localization].pose.point
        floor, frame = await self._context.open_floor(here)
        found = all_parts(areas, floor, frame, width)
        middles = np.array([(at.x, at.y) for at in (here, *(part[len(part) // 2].start for part in found))])
        costs = np.ascontiguousarray(np.hypot(*(middles[:, None] - middles).T))
        ways: list[list[Point]] = []
        for number in visiting_order(costs, PASSES, False).tolist()[1:]:
            ways.append(zigzag(found[number - 1], ways[-1][-1] if ways else here))
        return ways

    async def _run(self, action: Action, ways: Sequence[Sequence[Point]]) -> None:
        lanes = [Stretch(*way[k : k + 2]) for way in ways for k in range(0, len(way), 2)]
        if not lanes:
            raise Unreachable("there is no open floor to sweep")
        with Swept(self._robot, self._context.belief, action, lanes) as swept:
            await self._drive(action, lanes)
            if left := swept.left():  # the obstacle may be gone, with open floor before and behind it
                floor, frame = await self._context.open_floor(self._robot[Localization].pose.point)
                await self._drive(action, [open_ for lane in left for open_ in open_stretches(lane, floor, frame)])
            swept.report(final=True)
        if swept.done == 0.0:
            raise Unreachable("no lane was reachable")

    async def _drive(self, action: Action, lanes: Sequence[Stretch]) -> None:
        """Drive along ``lanes`` in turn; skip a lane that cannot be driven."""
        at = 0
        while at < len(lanes):
            points = [point for lane in lanes[at : at + LANES_AT_ONCE] for point in (lane.start, lane.end)]
            drive_progress = DriveProgress()
            try:
                goal = Goal(tuple(points), NavigationOptions(tolerance=TOLERANCE), straight=True)
                await self._navigation.drive(action, goal, drive_progress=drive_progress)
                at += LANES_AT_ONCE
            except (Unreachable, Blocked):
                at += drive_progress.passed // 2 + 1
