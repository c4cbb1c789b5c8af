"""The emergency stop: cuts the drive until it is released, and can let the wheels run free."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.robot import Robot


class EmergencyStop(Component):
    """While engaged or with the brake released, the base refuses to drive with ``EmergencyStopped``.

    While it is engaged, so do all other actuators: a jack, doors of boxes, an arm.

    Publishes ``EmergencyStopChanged`` and ``BrakeChanged``.
    """

    @property
    @abstractmethod
    def engaged(self) -> bool:
        """True while the button or an application holds the robot."""

    @abstractmethod
    def engage(self) -> None:
        """Stop all that moves at once; running drives and motions are cancelled."""

    @abstractmethod
    def release(self) -> None:
        """Allow driving again. Raises Refused while the button on the robot is pressed."""

    @property
    @abstractmethod
    def brake_released(self) -> bool:
        """True if the wheels run free, so that people can push the robot."""

    @abstractmethod
    def release_brake(self, released: bool) -> None:
        """Let the wheels run free, or hold them again."""


def is_stopped(robot: Robot) -> bool:
    """Return whether an emergency stop holds the robot: the button, an application, or limp legs (a dog's own stop)."""
    engaged = EmergencyStop in robot and robot[EmergencyStop].engaged
    return engaged or (Legs in robot and robot[Legs].posture is Posture.LIMP)
