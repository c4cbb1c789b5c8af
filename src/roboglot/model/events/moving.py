"""Actions and what gets in their way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from roboglot.model.events.stream import Event

if TYPE_CHECKING:
    from roboglot.model.action import Action
    from roboglot.model.geometry import Point


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionChanged(Event):
    """An action was accepted, began, paused, went on, reported feedback or ended; read its state from ``action``."""

    action: Action


@dataclass(frozen=True, slots=True, kw_only=True)
class PostureChanged(Event):
    """The legs reached another posture (a ``Posture`` value)."""

    posture: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PathBlocked(Event):
    """Something unexpected stands in the way of the action, near ``at`` (map; None: nowhere in particular)."""

    action: Action
    at: Point | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CorridorEntered(Event):
    """The action drives between two walls with little room, ``width`` m apart."""

    action: Action
    width: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotBlocked(Event):
    """The action has waited for a free way for ``seconds``; published once."""

    action: Action
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleBraked(Event):
    """Automatic emergency braking cut in, ``distance`` m before something."""

    distance: float


@dataclass(frozen=True, slots=True, kw_only=True)
class EmergencyStopChanged(Event):
    """The emergency stop was engaged or released."""

    engaged: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class BrakeChanged(Event):
    """The wheels were let run free, or are held again."""

    released: bool
