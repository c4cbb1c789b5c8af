"""Floor coverage, for cleaning and disinfection."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.components.mapping.annotations import Area
from roboglot.model.geometry import Point
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class SweepFeedback:
    """Metres of lanes driven, in total, and skipped as unreachable."""

    done: float
    total: float
    left_out: float


class Sweeping(Component):
    """Built on Navigation: covers the known free floor of an area, lane by lane. Feedback: ``SweepFeedback``."""

    @abstractmethod
    def sweep(self, areas: Sequence[Area] = (), *, width: float | None = None, source: str = "") -> Action:
        """Sweep ``areas`` (by default the map's coverage areas) with lanes ``width`` m apart (by default the hull's).

        Aborts with Unreachable if no lane could be driven. InvalidGoal if there is nothing to sweep, or more
        than 2000 lanes (as the action's reason).
        """

    @abstractmethod
    async def lanes(self, areas: Sequence[Area] = (), *, width: float | None = None) -> Sequence[Sequence[Point]]:
        """Return the lanes it would drive: for each part of the floor, their ends in order (map)."""
