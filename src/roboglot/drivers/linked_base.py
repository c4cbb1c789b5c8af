"""Shared part of the drivers' bases: checks velocities, and refuses to move without a link."""

from __future__ import annotations

import math

from roboglot.model.components.motion.base import Base, WheelSpeeds
from roboglot.model.components.system.link import Link
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.geometry import STILL, Twist

LATENCY_SMOOTHING = 0.2  # share of a new latency in the mean
OFF_DOCK = 0.6  # m straight ahead of a dock: off its contacts, with room to turn


def limits_refusal(skills: int) -> Refused | None:
    """Return why limits cannot change while so many ``skills`` of the robot's own move it; None for no skill."""
    if not skills:
        return None
    return Refused("the robot moves by a skill of its own now, which keeps the speed that it began with")


class LinkedBase(Base):
    """Accepts velocities only; drivers of robots with controllable wheels override ``set_wheel_speeds``."""

    wheels = "the wheels of this robot cannot be turned one by one"  # named in refusals

    def __init__(self, link: Link) -> None:
        self._link = link

    @property
    def refusal(self) -> Refused | None:
        return self._link.refusal

    def check(self, twist: Twist) -> None:
        """Check a velocity. Raises InvalidGoal if it is not finite, Unconnected if it cannot reach the robot."""
        if not all(map(math.isfinite, (twist.x, twist.y, twist.yaw))):
            raise InvalidGoal("a velocity must be finite")
        if twist != STILL:
            self._link.require()

    def set_wheel_speeds(self, speeds: WheelSpeeds) -> None:
        if speeds != WheelSpeeds():
            raise Refused(self.wheels)
        self.set_velocity(STILL)

    @property
    def wheel_speeds(self) -> WheelSpeeds:
        return WheelSpeeds()
