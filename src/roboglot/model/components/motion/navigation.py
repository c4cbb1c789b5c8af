"""Navigation: driving to goals without collisions."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from enum import StrEnum

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import POSITION_MAX, Path, Point
from roboglot.values import dataclass

NAVIGATE = "navigate to"  # the name of its actions
RETRIES_MAX = 1000


class Tracks(StrEnum):
    """Meaning of the map's tracks for one drive."""

    FREE = "free"  # any route
    PREFERRED = "preferred"  # preferred, even with a detour
    STRICT = "strict"  # required, except for short ways at start and goal; obstacles on them are not driven around


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationOptions:
    """Options of a drive: final ``yaw`` (rad in map, None: any), share of top speed, ``tolerance`` (m), retries.

    ``waits``: paths are planned by the map alone; the robot waits for other obstacles and does not drive around them.
    """

    yaw: float | None = None
    speed_ratio: float = 1.0
    tolerance: float = 0.05
    retries: int = 0
    tracks: Tracks = Tracks.FREE
    waits: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationFeedback:
    """``stage`` in the planner's words, the remaining path, remaining goals, and seconds left."""

    stage: str  # "planning", "driving", "waiting" (blocked), "turning"
    remaining: Path
    milestones: tuple[Point, ...]
    time_to_goal: float


def check_goals(goals: Sequence[Point], options: NavigationOptions, *, most: int) -> None:
    """Raise InvalidGoal for more goals than ``most`` or none, places off any map, and impossible options."""
    if not 1 <= len(goals) <= most:
        raise InvalidGoal(f"1 to {most} goals, not {len(goals)}")
    for goal in goals:
        if not math.hypot(goal.x, goal.y) <= POSITION_MAX:
            raise InvalidGoal(f"not a place on this map: {goal}")
    if options.yaw is not None and not math.isfinite(options.yaw):
        raise InvalidGoal("the final yaw is not a number")
    if not 0.0 < options.speed_ratio <= 1.0:
        raise InvalidGoal(f"a share of the top speed must be above 0 and at most 1, not {options.speed_ratio}")
    if not 0.0 < options.tolerance <= POSITION_MAX:
        raise InvalidGoal(f"a tolerance must be above 0, not {options.tolerance}")
    if not 0 <= options.retries <= RETRIES_MAX:
        raise InvalidGoal(f"0 to {RETRIES_MAX} retries, not {options.retries}")


class Navigation(Component):
    """Plans on the map and current scans; its actions, named NAVIGATE, report ``NavigationFeedback``."""

    @abstractmethod
    def navigate_to(self, goals: Sequence[Point], options: NavigationOptions, *, source: str = "") -> Action:
        """Drive through ``goals`` (map frame) in turn. Aborts with Unreachable, Blocked or NotLocalized."""

    @abstractmethod
    async def plan(self, start: Point, goal: Point) -> Path:
        """Return the path that it would drive. Raises Unreachable."""

    @abstractmethod
    async def visiting_order(self, places: Sequence[Point], *, round_trip: bool = False) -> Sequence[int]:
        """Return the indices of ``places`` (map) in the order of a short tour from here, and back if ``round_trip``.

        The shortest tour by planned paths up to 12 places; beyond, a good one. Unreachable places come last without
        ``round_trip``; with it, they raise Unreachable. Raises InvalidGoal beyond 500.
        """
