"""Automatic emergency braking: the robot stops by itself in front of obstacles."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component


class EmergencyBraking(Component):
    """Publishes ``ObstacleBraked`` when it intervenes. Driving away from the obstacle stays possible."""

    @property
    @abstractmethod
    def enabled(self) -> bool:
        """True if it is switched on."""

    @abstractmethod
    def enable(self, on: bool) -> None:
        """Switch it."""

    @property
    @abstractmethod
    def braking(self) -> bool:
        """True while it holds the robot back."""
