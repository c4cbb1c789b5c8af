"""Navigation: driving to goals without collisions."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from enum import StrEnum

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.geometry import Path, Point
from roboglot.values import dataclass


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


class Navigation(Component):
    """Plans on the map and current scans; its actions' feedback is ``NavigationFeedback``."""

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
