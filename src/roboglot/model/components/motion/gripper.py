"""A gripper with two jaws at the end of the arm."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.errors import InvalidGoal

GRIPPER = "gripper"  # the resource of all actions that move the jaws
LEVEL_MAX = 4


class GripperStatus(StrEnum):
    """Position of the jaws."""

    CLOSED = "closed"
    BETWEEN = "between"  # moving, stopped, or closed around an object
    OPEN = "open"


def check_level(level: int) -> None:
    """Raise InvalidGoal outside 1 to LEVEL_MAX."""
    if not 1 <= level <= LEVEL_MAX:
        raise InvalidGoal(f"a gripper's level is 1 to {LEVEL_MAX}, not {level}")


class Gripper(Component):
    """A higher level (1 to 4) is faster and stronger."""

    @property
    @abstractmethod
    def status(self) -> GripperStatus:
        """True position of the jaws."""

    @property
    @abstractmethod
    def opening(self) -> float:
        """Distance between the jaws, m."""

    @abstractmethod
    def open(self, level: int = 1, *, source: str = "") -> Action:
        """Open the jaws, letting go of what they hold; raises InvalidGoal for a level outside 1 to 4."""

    @abstractmethod
    def close(self, level: int = 1, *, source: str = "") -> Action:
        """Close the jaws until they meet or press on something; raises InvalidGoal for a level outside 1 to 4."""

    @abstractmethod
    def stop(self) -> None:
        """Cancel the jaws' action; they hold their position."""
