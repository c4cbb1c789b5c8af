"""Automatic emergency braking: the robot stops by itself before what is right ahead."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component


class EmergencyBraking(Component):
    """Publishes ``ObstacleBraked`` when it cuts in. Driving away from what is ahead stays possible."""

    @property
    @abstractmethod
    def enabled(self) -> bool:
        """True if it watches."""

    @abstractmethod
    def enable(self, on: bool) -> None:
        """Switch it."""

    @property
    @abstractmethod
    def braking(self) -> bool:
        """True if it holds the robot back now."""
