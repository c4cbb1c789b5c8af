"""State shared by all drives of one robot: the planner, once loaded, and calls to it."""

from __future__ import annotations

from dataclasses import field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.computing import computed
from roboglot.autonomy.docking.shelf_legs import Load
from roboglot.autonomy.navigation.pilot_tuning import PilotTuning
from roboglot.autonomy.navigation.planning_options import KeepClear, PlanningOptions
from roboglot.autonomy.navigation.rules import GridFrame
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.traffic.traffic import Traffic
from roboglot.model.components.mapping.annotations import Annotations, MapAnnotations
from roboglot.model.components.mapping.map_memory import settle
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.navigation import NavigationOptions
from roboglot.model.errors import NotLocalized, RobotError
from roboglot.model.geometry import Point
from roboglot.model.robot import Robot
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.autonomy.navigation.planner import Planner
    from roboglot.autonomy.navigation.route import Route

SPEED_MAX = 1.2  # m/s beyond which the robot could not stop for a person who steps out of a door
READY_MAX = 180.0  # s for which a drive waits for the planner and the first map


@dataclass(frozen=True, slots=True)
class Goal:
    """Goals (map) and options of a drive; ``straight``: straight lines between goals wherever the hull fits."""

    points: tuple[Point, ...]
    options: NavigationOptions
    straight: bool = False


@dataclass(slots=True)
class NavigationContext:
    """``planner`` is None until the kernels are loaded; ``unavailable``: the error if that takes long or failed."""

    robot: Robot
    belief: Belief
    traffic: Traffic
    planner: Planner | None = None
    unavailable: RobotError | None = None
    load: Load = field(default_factory=Load)
    tuning: PilotTuning = field(default_factory=PilotTuning)

    def check_available(self) -> None:
        """Raise NotReady while kernels compile, Refused if they cannot be compiled."""
        if self.unavailable is not None:
            raise type(self.unavailable)(str(self.unavailable))

    async def ready(self) -> Planner:
        """Return the planner as soon as it is loaded and there is a map, with its own drawings.

        Raises NotLocalized if there is no map in time, NotReady or Refused as ``check_available``.
        """
        clock = self.robot.clock
        deadline = clock.time() + READY_MAX
        while self.planner is None or not self.belief.revision:
            self.check_available()
            if clock.time() > deadline:
                raise NotLocalized("no scan arrived to make a map from")
            await clock.sleep(0.1)
        await settle(self.robot)
        return self.planner

    @property
    def drawn(self) -> Annotations:
        """Annotations drawn on the map by people."""
        return self.robot[MapAnnotations].current if MapAnnotations in self.robot else Annotations()

    def top_speed(self, options: NavigationOptions) -> float:
        """Return the top speed on open floor, m/s."""
        return min(SPEED_MAX, self.robot[Base].limits.twist.x) * options.speed_ratio

    async def plan(
        self,
        start: Point,
        goals: tuple[Point, ...],
        options: NavigationOptions,
        *,
        obstacles: bool = True,
        things: bool = True,
        straight: bool = False,
    ) -> Route:
        """Return a route (map) around known and, with ``obstacles``, recently seen obstacles. Raises Unreachable."""
        planner = await self.ready()
        limits = self.robot[Base].limits
        task = planner.task(
            start,
            goals,
            PlanningOptions(
                now=self.robot.clock.time(),
                top=self.top_speed(options),
                acceleration=limits.linear_acceleration,
                tolerance=options.tolerance,
                drawn=self.drawn,
                tracks=options.tracks,
                obstacles=obstacles,
                things=things,
                straight=straight,
                keep_clear=self.traffic.ways_to_avoid() if obstacles else (),
            ),
        )
        return await computed(self.robot.clock, task.solve)

    async def waiting_place(self, here: Point, ways: KeepClear) -> Point | None:
        """Return the nearest place that keeps the distances to ``ways`` (map); None if there is none nearby."""
        planner = await self.ready()
        task = planner.task(here, (here,), replace(self._slowly(0.0), keep_clear=ways))
        return await computed(self.robot.clock, task.waiting_place)

    async def lengths(self, stops: tuple[Point, ...], reach: float) -> NDArray[np.float64]:
        """Return rough distances (m) between all pairs of ``stops``; inf where no way leads to within ``reach`` m."""
        planner = await self.ready()
        task = planner.task(stops[0], stops[1:], self._slowly(reach))
        return await computed(self.robot.clock, task.lengths)

    async def open_floor(self, around: Point) -> tuple[NDArray[np.bool_], GridFrame]:
        """Return the cells where the hull may stand, by map, annotations and recent sightings, and their frame."""
        planner = await self.ready()
        task = planner.task(around, (around,), self._slowly(0.0))
        return await computed(self.robot.clock, task.floor)

    def _slowly(self, tolerance: float) -> PlanningOptions:
        """Return options for plans that do not depend on speed."""
        now = self.robot.clock.time()
        return PlanningOptions(now=now, top=1.0, acceleration=1.0, tolerance=tolerance, drawn=self.drawn)
