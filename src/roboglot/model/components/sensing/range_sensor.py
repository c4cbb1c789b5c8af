"""Single-beam distance sensors: infrared, ultrasonic, time of flight."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.geometry import Pose
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class RangeReading:
    """ROS's Range: the nearest thing in the cone, m; inf when nothing is within ``range_max``.

    Nearer than ``range_min`` reads as ``range_min``. ``field_of_view`` in rad; ``mount`` in base_link, ``height`` above
    the ground, m.
    """

    stamp: float
    distance: float
    range_min: float
    range_max: float
    field_of_view: float
    mount: Pose
    height: float


class RangeSensors(Component):
    """All sensors of the robot by name, in the order of the body's description."""

    names: tuple[str, ...]
    silent: frozenset[str] = frozenset()  # sensors that no longer respond

    @property
    @abstractmethod
    def measuring(self) -> bool:
        """True if they measure; off at power-on."""

    @abstractmethod
    def measure(self, on: bool) -> None:
        """Switch all of them on or off."""

    @abstractmethod
    def reading(self, name: str) -> RangeReading | None:
        """Return the latest reading; None while off, and of a silent sensor. Raises NotFound."""
