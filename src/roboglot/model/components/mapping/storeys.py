"""Places on other floors, and rides to them. Provided by the store of the building's maps; empty without one."""

from __future__ import annotations

from typing import Protocol

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.maps import PointOfInterest
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class StoreyPlace:
    """A place, and the floor that it is on."""

    floor: str
    place: PointOfInterest


class StoreyMaps(Protocol):
    """Interface of the store of a building's maps; floors are identified by name."""

    @property
    def current(self) -> str:
        """Floor of the robot."""

    @property
    def in_car(self) -> bool:
        """True if the robot is in a lift's car; ``go_to`` brings it out, also on the floor where it is."""

    def places(self) -> list[StoreyPlace]:
        """Return the places of all other floors, in the order of the floors."""

    def home(self) -> str:
        """Floor of the robot's home dock."""

    def go_to(self, floor: str, source: str) -> Action:
        """Ride to a floor and switch to its map, places and docks. Raises InvalidGoal for an unknown floor."""


class Storeys(Component):
    """``maps`` is set by the store of the maps; None while there is none."""

    maps: StoreyMaps | None = None
