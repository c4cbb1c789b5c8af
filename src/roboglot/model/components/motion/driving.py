"""Manual driving: velocities and short moves by odometry, each an action that holds the base."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.geometry import Pose, Twist

BASE = "base"  # the resource of all actions that move the robot over the floor


class Driving(Component):
    """Built on Base and Odometry (and Legs: a lying robot stands up first). Does not avoid obstacles."""

    @abstractmethod
    def drive(self, command: Twist | WheelSpeeds, *, lifetime: float | None = None, source: str = "") -> Action:
        """Keep ``command`` until it is replaced or cancelled, or ``lifetime`` seconds passed (then it SUCCEEDED).

        If the same source is driving already, its action continues with the new command, without a gap.
        """

    @abstractmethod
    def move_by(
        self, offset: Pose, *, speed: float | None = None, yaw_speed: float | None = None, source: str = ""
    ) -> Action:
        """Move by ``offset`` (base_link at the start; its yaw may exceed a turn) at up to these speeds (m/s, rad/s).

        Translation and rotation end together where the speeds allow. Succeeds within 1 cm / 1 degree of odometry.
        If the same source is already in such a move, that one ends cancelled and this one continues at its speed,
        without a stop in between.
        """
