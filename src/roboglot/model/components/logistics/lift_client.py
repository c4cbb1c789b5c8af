"""The robot's radio link to the building's lift."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.components.component import Component
from roboglot.values import dataclass


class LiftDoor(StrEnum):
    """State of the lift's doors, car and landing together."""

    OPEN = "open"
    OPENING = "opening"
    CLOSING = "closing"
    CLOSED = "closed"


@dataclass(frozen=True, slots=True)
class LiftState:
    """State of the lift as received by radio. Floors are counted from 0, the lowest.

    ``floor`` is the nearest one, ``target`` where the car goes (None: it rests), ``load`` the share of the load that it
    may carry, ``blocked`` whether something keeps the door from closing.
    """

    floor: int
    target: int | None
    door: LiftDoor
    load: float
    in_service: bool
    blocked: bool


class LiftClient(Component):
    """Publishes ``LiftCalled``, ``LiftArrived``, ``LiftDoorOpened``, ``LiftDoorClosed`` and ``LiftFailed``.

    Every method raises Refused while the radio is out of reach or the lift out of service.
    """

    floors: tuple[str, ...]  # names of its stops, lowest first

    @property
    @abstractmethod
    def state(self) -> LiftState:
        """Latest state received."""

    @abstractmethod
    def call(self, floor: int) -> None:
        """Call the car to (or, from within, send it to) ``floor``, doors opening. Raises InvalidGoal."""

    @abstractmethod
    def hold_door(self, seconds: float) -> None:
        """Keep the door open for ``seconds`` (at most 120) where the car stands; open it if it is shut."""

    @abstractmethod
    def close_door(self) -> None:
        """Stop holding the door; it closes once nothing blocks it."""
