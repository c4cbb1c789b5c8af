"""Temperature sensors of the motors."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

from roboglot.model.components.component import Component


class Motors(Component):
    """Every motor by name ("left front hip"), in the body's order."""

    hot: float = 85.0  # Celsius from which a motor is too hot to continue

    @property
    @abstractmethod
    def temperatures(self) -> Mapping[str, float]:
        """Current temperatures, degrees Celsius."""

    @property
    def hottest(self) -> float:
        """Temperature of the warmest motor, degrees Celsius."""
        return max(self.temperatures.values())
