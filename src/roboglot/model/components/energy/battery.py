"""The battery and its charging contacts."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.sensing import BatteryState


class Battery(Component):
    """Drains by what the robot does; publishes ``BatteryChanged``."""

    low: float = 0.15  # charge below which the robot's battery is low

    @property
    @abstractmethod
    def state(self) -> BatteryState:
        """Current state."""


class DockContact(Component):
    """The charging contacts; publishes ``DockContactChanged``."""

    @property
    @abstractmethod
    def docked(self) -> bool:
        """True if the contacts touch a dock."""
