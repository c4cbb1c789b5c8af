"""Ultra-wideband ranging: distance and direction of a tag."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class TagReading:
    """``distance`` (m) and ``azimuth`` (rad in base_link, counter-clockwise, 0 ahead) of the tag at ``address``.

    Walls and people in between add range error and noise: ``line_of_sight`` is then false.
    """

    stamp: float
    address: str
    distance: float
    azimuth: float
    line_of_sight: bool


class UltraWideband(Component):
    """Ranges the tag of the connected Bluetooth device."""

    @property
    @abstractmethod
    def tag(self) -> TagReading | None:
        """Latest reading; None while no tag is connected or received."""
