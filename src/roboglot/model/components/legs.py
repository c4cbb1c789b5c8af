"""Legs: standing, lying and what is between."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.actions import Action
from roboglot.model.components.component import Component

LEGS = "legs"  # the resource that posture changes hold, together with BASE


class Posture(StrEnum):
    """How the body is held."""

    STANDING = "standing"
    LYING = "lying"
    LIMP = "limp"  # motors without torque after an emergency stop; only standing up leads out
    CHANGING = "changing"


class Legs(Component):
    """Postures take time and hold the base meanwhile; nobody drives while not STANDING."""

    @property
    @abstractmethod
    def posture(self) -> Posture:
        """Now."""

    @property
    @abstractmethod
    def body_height(self) -> float:
        """Height of the body's belly above the floor, m, now."""

    @abstractmethod
    def stand(self, *, source: str = "") -> Action:
        """Stand up; succeeds at once if standing."""

    @abstractmethod
    def lie_down(self, *, source: str = "") -> Action:
        """Brake and lie down; succeeds at once if lying."""

    @abstractmethod
    def go_limp(self) -> None:
        """Emergency: cancel everything that holds the base and let the body sink at once."""
