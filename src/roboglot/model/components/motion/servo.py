"""Free servos at the robot's extension ports."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.actions import Action
from roboglot.model.components.component import Component

SERVO = "servo "  # prefix of the servos' resources


def servo_resource(number: int) -> str:
    """Return the resource of the actions that turn this servo."""
    return f"{SERVO}{number}"


class Servos(Component):
    """Numbered from 1. An unknown number raises NotFound everywhere."""

    count: int
    limit: float  # rad to either side
    speed: float  # rad/s at most

    @abstractmethod
    def angle(self, number: int) -> float:
        """Return the angle, rad in [-pi, pi]; half a turn has the sign of the side that it was reached from."""

    @abstractmethod
    def move_to(self, number: int, angle: float, *, speed: float | None = None, source: str = "") -> Action:
        """Turn to ``angle`` (rad) at up to ``speed`` (rad/s) and hold; raises InvalidGoal beyond the limits."""

    @abstractmethod
    def set_speed(self, number: int, speed: float, *, source: str = "") -> Action:
        """Keep turning at ``speed`` (rad/s, cut to the limit) until the next command; 0 stops and SUCCEEDs."""

    @abstractmethod
    def stop(self, number: int | None = None) -> None:
        """Cancel the action of this servo, or of all; they hold their angle."""
