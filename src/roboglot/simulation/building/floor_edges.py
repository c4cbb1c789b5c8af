"""Edges of the floor: holes, the shaft without the lift's car, open ends.

World frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from roboglot.simulation.building.blueprint import Rectangle, holes_of, shaft_of
from roboglot.simulation.world.description import WorldDescription

if TYPE_CHECKING:
    from roboglot.simulation.building.lift import LiftCar

STEP = 0.03  # m by which the car may be lower before that counts as a drop


class FloorEdges:
    """Ground under robots, by floors, holes and the lift's car."""

    def __init__(self, world: WorldDescription, lift: LiftCar | None) -> None:
        self._holes = [holes_of(floor) for floor in world.floors]
        self._edges = [None if f.enclosed else Rectangle(*f.origin, *f.size) for f in world.floors]
        self._lift = lift
        self._shaft = shaft_of(world.lift) if world.lift else None

    def ends_near(self, x: float, y: float, floor: int, elevation: float, reach: float) -> bool:
        """True if the floor may end within ``reach`` m at this elevation (m): a quick first check."""
        edge = self._edges[floor]
        if edge is not None and not (
            edge.x + reach <= x <= edge.x + edge.width - reach and edge.y + reach <= y <= edge.y + edge.depth - reach
        ):
            return True
        if not self._holes[floor] and (self._shaft is None or self._shaft.distance_to(x, y) > reach):
            return False
        return any(gap.distance_to(x, y) <= reach for gap in self._gaps(floor, elevation))

    def room(self, x: float, y: float, floor: int) -> float:
        """Return the distance to the nearest possible end of the floor, for any place of the lift's car, m."""
        gaps = [*self._holes[floor], *([self._shaft] if self._shaft else [])]
        nearest = min((gap.distance_to(x, y) for gap in gaps), default=math.inf)
        edge = self._edges[floor]
        if edge is not None:
            inside = min(x - edge.x, edge.x + edge.width - x, y - edge.y, edge.y + edge.depth - y)
            nearest = min(nearest, inside)
        return nearest

    def carries(self, elevation: float) -> bool:
        """True if the ground at this elevation (m) is the lift's car between two floors."""
        return self._lift is not None and abs(self._lift.elevation - elevation) <= STEP

    def missing(self, x: float, y: float, floor: int, elevation: float) -> bool:
        """True if there is no ground at this elevation (m)."""
        edge = self._edges[floor]
        if edge is not None and edge.distance_to(x, y) > 0.0:
            return True
        return any(gap.distance_to(x, y) == 0.0 for gap in self._gaps(floor, elevation))

    def _gaps(self, floor: int, elevation: float) -> Iterator[Rectangle]:
        yield from self._holes[floor]
        if self._shaft is not None and self._lift is not None and abs(self._lift.elevation - elevation) > STEP:
            yield self._shaft
