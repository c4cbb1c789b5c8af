"""First argument of every handler: the robot, the settings, and a way to write to ``/rosout``."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.actions import Action
from roboglot.model.robot import Robot
from roboglot.protocols.ros2.config import Ros2Config
from roboglot.protocols.ros2.vocabulary import DOOR
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Context:
    """One robot's door. ``follow`` reports on ``/rosout`` how an action ends, unless all is well."""

    robot: Robot
    config: Ros2Config
    follow: Callable[[Action], None]

    @property
    def source(self) -> str:
        """Source of the actions that are started here."""
        return DOOR
