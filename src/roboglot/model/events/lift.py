"""Events of the lift that the robot rides."""

from __future__ import annotations

from roboglot.model.events.stream import Event
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftCalled(Event):
    """The lift accepted this robot's call to ``floor``."""

    floor: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftArrived(Event):
    """The lift stands at ``floor`` because it was called there."""

    floor: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftDoorOpened(Event):
    """Door of the lift stands wide open at ``floor``."""

    floor: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftDoorClosed(Event):
    """Door of the lift is shut, the car at ``floor``."""

    floor: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LiftFailed(Event):
    """The lift cannot serve a call: ``reason`` is "out of service", "door blocked" or "overloaded"."""

    reason: str
