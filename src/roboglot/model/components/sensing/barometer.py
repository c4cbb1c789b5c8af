"""The barometer, which feels how high the robot stands."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

from roboglot.model.components.component import Component


@dataclass(frozen=True, slots=True)
class BarometerReading:
    """``pressure`` of the air and one standard ``deviation`` of its noise, Pa; ``stamp``: robot time, s."""

    stamp: float
    pressure: float
    deviation: float = 0.0


class Barometer(Component):
    """The air's pressure falls by 12 Pa with each metre: a floor of a building is about 40 Pa."""

    @property
    @abstractmethod
    def reading(self) -> BarometerReading:
        """The newest measurement."""
