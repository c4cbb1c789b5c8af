"""The floors of a building that the robot goes between by lift, each with its own map, dock and annotations."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.actions import Action, OnBusy
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
        """The floor whose map is in use."""

    @abstractmethod
    def begin_on(self, floor: int) -> None:
        """Say that the present map is of ``floor``. InvalidGoal for no such floor."""

    @abstractmethod
    def set_lift(self, waiting: Pose, inside: Pose) -> None:
        """On the present map: where to wait and where to stand in the car. InvalidGoal for nonsense."""

    @abstractmethod
    def ride(self, floor: int, *, redraw: bool = True, source: str = "", on_busy: OnBusy = OnBusy.REPLACE) -> Action:
        """To the lift, in, to ``floor``, out; its map is used from then on, a new one where there is none yet.

        Not ``redraw``: the annotations stay, for the caller to replace.

        Feedback: ``RideStage``. Aborts with Expired (the lift did not come), Blocked (a person stands in the way),
        Refused (out of service, out of reach) and navigation's errors. InvalidGoal without a known lift.
        """
