"""Floors of a building, joined by lift, each with its own map, dock and annotations."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.geometry import Pose


class RideStage(StrEnum):
    """Feedback of riding."""

    APPROACHING = "approaching the lift"
    CALLING = "waiting for the lift"
    BOARDING = "boarding"
    RIDING = "riding"
    LEAVING = "leaving"
    ARRIVED = "arrived"


class Floors(Component):
    """Made of LiftClient, Navigation and Mapping. Floors are counted from 0, as the lift does."""

    @property
    @abstractmethod
    def current(self) -> int:
        """Floor whose map is in use."""

    @abstractmethod
    def begin_on(self, floor: int) -> None:
        """Declare the current map to be that of ``floor``. Raises InvalidGoal."""

    @abstractmethod
    async def be_carried(self, floor: int) -> None:
        """Use the map of ``floor``, to which the robot was carried, or a new one; the lidar has to find its place.

        Raises InvalidGoal for a floor at which no lift stops.
        """

    @abstractmethod
    def set_lift(self, waiting: Pose, inside: Pose) -> None:
        """Set the poses to wait at and to stand at in the car, on the current map. Raises InvalidGoal."""

    @abstractmethod
    def ride(self, floor: int, *, redraw: bool = True, source: str = "") -> Action:
        """Ride the lift to ``floor`` and leave it there; switch to its map, or to a new one if it has none.

        Without ``redraw``, the annotations stay, for the caller to replace.

        Feedback: ``RideStage``. Aborts with Expired (the lift did not come), Blocked (a person stands in the way),
        Refused (out of service, out of reach) and navigation's errors. InvalidGoal without a known lift.
        """
