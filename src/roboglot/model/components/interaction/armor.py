"""Armor plates that detect hits."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.components.component import Component
from roboglot.model.errors import InvalidGoal

SENSITIVITY_MAX = 10


class PlatePlace(StrEnum):
    """Place of an armor plate on the robot."""

    REAR = "rear"
    FRONT = "front"
    LEFT = "left"
    RIGHT = "right"
    GIMBAL_LEFT = "gimbal left"
    GIMBAL_RIGHT = "gimbal right"


class HitKind(StrEnum):
    """Cause of a hit on a plate."""

    BEAD = "bead"
    COLLISION = "collision"
    HAND = "hand"


def check_sensitivity(sensitivity: int) -> None:
    """Raise InvalidGoal outside 0 to SENSITIVITY_MAX."""
    if not 0 <= sensitivity <= SENSITIVITY_MAX:
        raise InvalidGoal(f"a sensitivity is 0 to {SENSITIVITY_MAX}, not {sensitivity}")


class Armor(Component):
    """Publishes ``ArmorHit``. The lower the sensitivity, the harder a bead or collision must be; hands always count."""

    plates: tuple[PlatePlace, ...]

    @property
    @abstractmethod
    def sensitivity(self) -> int:
        """Sensitivity, 0 (hard blows only) to 10; 5 at power-on."""

    @abstractmethod
    def set_sensitivity(self, sensitivity: int) -> None:
        """Set the sensitivity. Raises InvalidGoal outside 0 to 10."""
