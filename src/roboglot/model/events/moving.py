"""Events of actions and of obstacles in their way."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboglot.model.events.stream import Event
from roboglot.values import dataclass

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
    """An unexpected obstacle stands in the action's way, near ``at`` (map; None: unknown)."""

    action: Action
    at: Point | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CorridorEntered(Event):
    """The action drives into a narrow corridor, ``width`` m wide."""

    action: Action
    width: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotBlocked(Event):
    """The action has waited for a free way for ``seconds``; published once."""

    action: Action
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleBraked(Event):
    """Automatic emergency braking intervened, ``distance`` m from an obstacle."""

    distance: float


@dataclass(frozen=True, slots=True, kw_only=True)
class EmergencyStopChanged(Event):
    """The emergency stop was engaged or released."""

    engaged: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class BrakeChanged(Event):
    """The brake was released or applied."""

    released: bool
