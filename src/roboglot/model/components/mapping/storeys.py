"""The other floors' places, and the way there. Whoever keeps the building's maps knows them: without him, none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.maps import PointOfInterest


@dataclass(frozen=True, slots=True)
class StoreyPlace:
    """A place, and the floor that it is on."""

    floor: str
    place: PointOfInterest


class StoreyMaps(Protocol):
    """What a keeper of maps of several floors can tell and do. Floors go by a name that is theirs."""

    @property
    def current(self) -> str:
        """The floor that the robot is on."""

    def places(self) -> list[StoreyPlace]:
        """Those of all other floors, in the order of the floors."""

    def home(self) -> str:
        """The floor of the dock that the robot goes home to."""

    def go_to(self, floor: str, source: str) -> Action:
        """Ride there; its map, places and docks are in use then. InvalidGoal for a floor that is not known."""


class Storeys(Component):
    """``maps`` is set by whoever keeps them, and None while nobody does."""

    maps: StoreyMaps | None = None
