"""Manual driving: velocities and short moves by odometry, each an action that holds the base."""

from __future__ import annotations

import math
from abc import abstractmethod

from msgspec.structs import astuple

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Pose, Twist

BASE = "base"  # the resource of all actions that move the robot over the floor

MOVE_MAX = 1000.0  # m in one move
TURN_MAX = 1000.0  # rad in one move
LIFETIME_MAX = 86_400.0  # s


def check_command(command: Twist | WheelSpeeds, lifetime: float | None) -> None:
    """Raise InvalidGoal for numbers that are not finite, or a lifetime out of range."""
    if not all(map(math.isfinite, astuple(command))):
        raise InvalidGoal(f"not a velocity: {command}")
    if lifetime is not None and not 0 < lifetime <= LIFETIME_MAX:
        raise InvalidGoal(f"a lifetime must be above 0 and at most {LIFETIME_MAX:g} s, not {lifetime}")


def check_offset(offset: Pose) -> None:
    """Raise InvalidGoal for a move that is too long, or not finite."""
    if not (math.hypot(offset.x, offset.y) <= MOVE_MAX and abs(offset.yaw) <= TURN_MAX):
        raise InvalidGoal(f"a move is at most {MOVE_MAX:g} m and {TURN_MAX:g} rad, not {offset}")


def top_speed(wanted: float | None, limit: float, what: str) -> float:
    """Return ``wanted`` (None: any) within the base's limit. Raises InvalidGoal, naming ``what``."""
    if wanted is None:
        return limit
    if not wanted > 0:
        raise InvalidGoal(f"the {what} must be above 0, not {wanted}")
    return min(wanted, limit)


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
