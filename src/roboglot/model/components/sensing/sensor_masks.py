"""Masks that switch off single sensors, for instance where a ramp or a curtain fools them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from enum import StrEnum

from roboglot.model.components.component import Component
from roboglot.values import dataclass


class SensorKind(StrEnum):
    """Kind of a sensor that can be masked."""

    BUMPER = "bumper"
    CLIFF = "cliff"
    DEPTH_CAMERA = "depth camera"


@dataclass(frozen=True, slots=True)
class Sensor:
    """One maskable sensor; ``zone`` says where on the robot it sits."""

    id: int
    kind: SensorKind
    zone: str


class SensorMasks(Component):
    """A masked sensor reports nothing, as if it were not there."""

    sensors: Sequence[Sensor]

    @property
    @abstractmethod
    def masked(self) -> dict[int, bool]:
        """Ids of the masked sensors; True: until unmasked, False: until the robot restarts."""

    @abstractmethod
    def mask(self, id: int, *, always: bool = False) -> None:
        """Mask a sensor. Raises NotFound."""

    @abstractmethod
    def unmask(self, id: int) -> None:
        """Unmask a sensor. Raises NotFound."""

    @abstractmethod
    def masks(self, kind: SensorKind, zone: str) -> bool:
        """Return whether the sensor in that zone is masked."""
