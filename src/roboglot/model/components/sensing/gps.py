"""Satellite navigation."""

from __future__ import annotations

from abc import abstractmethod
from enum import IntEnum

from roboglot.model.components.component import Component
from roboglot.values import dataclass


class GpsFix(IntEnum):
    """Kind of a satellite fix."""

    NONE = 0
    PLANE = 2  # latitude and longitude only
    SPACE = 3  # with altitude


@dataclass(frozen=True, slots=True)
class GpsReading:
    """WGS-84: degrees (north and east positive), ``altitude`` and one standard deviation ``accuracy`` in m.

    Without a fix the numbers are those of the last one, or 0.
    """

    stamp: float
    fix: GpsFix = GpsFix.NONE
    satellites: int = 0
    latitude: float = 0.0
    longitude: float = 0.0
    altitude: float = 0.0
    accuracy: float = 0.0


class Gps(Component):
    """Works under the open sky only."""

    @property
    @abstractmethod
    def reading(self) -> GpsReading:
        """Latest reading."""
