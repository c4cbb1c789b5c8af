"""Interface of the physics that the building needs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.building.props import Props
from roboglot.simulation.building.terrain import Ground
from roboglot.simulation.building.walls import Walls


class Mechanics(Protocol):
    """Part of a world's physics that moves the building's parts."""

    @property
    def props(self) -> Props:
        """Things that can be placed."""

    @property
    def hulls(self) -> Mapping[str, Hull]:
        """Robots' hulls by name."""

    @property
    def ground(self) -> Ground:
        """Relief of the floors."""

    @property
    def walls(self) -> Walls:
        """Walls and furniture."""

    @property
    def car_lift(self) -> float:
        """Height of the lift's car above where it was parked, m."""

    def drive_car(self, lift: float) -> None:
        """Drive the lift's car to this height (m) above where it was parked."""
