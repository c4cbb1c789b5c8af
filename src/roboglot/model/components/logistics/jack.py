"""The jack: a platform on top of the robot that lifts shelves."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.actions import Action
from roboglot.model.components.component import Component

JACK = "jack"  # the resource that its movements hold


class JackStage(StrEnum):
    """Stage of the jack's platform."""

    DOWN = "down"
    MOVING = "moving"
    UP = "up"
    STOPPED = "stopped"  # between the ends


class Jack(Component):
    """Moves at its own pace; publishes ``JackChanged``. Blocked, it stops with an alarm that must be cleared."""

    stroke: float  # m from DOWN to UP

    @property
    @abstractmethod
    def stage(self) -> JackStage:
        """Current state."""

    @property
    @abstractmethod
    def position(self) -> float:
        """Height of the platform above its lowest position, m."""

    @property
    @abstractmethod
    def loaded(self) -> bool:
        """True if something rests on the platform. Raises Refused if the robot does not report it."""

    @property
    @abstractmethod
    def alarm(self) -> str:
        """Reason for the alarm that stopped the jack, in plain words; empty without one."""

    @abstractmethod
    def raise_platform(self, *, source: str = "") -> Action:
        """Raise the platform; aborts with Blocked, or with Refused while an alarm is active."""

    @abstractmethod
    def lower_platform(self, *, source: str = "") -> Action:
        """Lower the platform; aborts with Blocked, or with Refused while an alarm is active."""

    @abstractmethod
    def clear_alarm(self) -> None:
        """Acknowledge the alarm; it returns if its cause persists."""
