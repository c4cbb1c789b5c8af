"""Ultra-wideband ranging: where a tag is, as the robot's antennas feel it."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

from roboglot.model.components.component import Component


@dataclass(frozen=True, slots=True)
class TagReading:
    """``distance`` (m) and ``azimuth`` (rad in base_link, counter-clockwise, 0 ahead) of the tag at ``address``.

    Walls and people in between make it farther and less sure: ``line_of_sight`` is then false.
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
        """The newest; None while no tag is connected or heard."""
