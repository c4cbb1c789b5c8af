"""The barometer, which measures air pressure and so the robot's height."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class BarometerReading:
    """``pressure`` of the air and one standard ``deviation`` of its noise, Pa; ``stamp``: robot time, s."""

    stamp: float
    pressure: float
    deviation: float = 0.0


class Barometer(Component):
    """Air pressure falls by 12 Pa per metre: a storey is about 40 Pa."""

    @property
    @abstractmethod
    def reading(self) -> BarometerReading:
        """Latest measurement."""
