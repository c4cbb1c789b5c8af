"""A robot arm that moves its end point in a vertical plane straight ahead."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.values import dataclass

ARM = "arm"  # the resource of all actions that move the arm


@dataclass(frozen=True, slots=True)
class ArmPosition:
    """The end point relative to the arm's shoulder: ``x`` forward and ``z`` up, m."""

    x: float = 0.0
    z: float = 0.0


@dataclass(frozen=True, slots=True)
class ArmReach:
    """Workspace of the arm's end point: inside the rectangle and within ``radius`` (m) of the shoulder."""

    lowest: ArmPosition
    highest: ArmPosition
    radius: float


class Arm(Component):
    """Moves in straight lines; holds its position between commands."""

    reach: ArmReach
    home: ArmPosition

    @property
    @abstractmethod
    def position(self) -> ArmPosition:
        """Current state."""

    @abstractmethod
    def move_to(self, position: ArmPosition, *, source: str = "") -> Action:
        """Move to a position; raises InvalidGoal out of reach."""

    @abstractmethod
    def move_by(self, offset: ArmPosition, *, source: str = "") -> Action:
        """Move by an offset from the current position; raises InvalidGoal out of reach."""

    @abstractmethod
    def recenter(self, *, source: str = "") -> Action:
        """Move to ``home``."""

    @abstractmethod
    def stop(self) -> None:
        """Cancel its action and hold the position."""
