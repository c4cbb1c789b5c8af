"""What the bases of all drivers share: what is no velocity, and that nothing moves without a link."""

from __future__ import annotations

import math

from roboglot.model.components.motion.base import Base, WheelSpeeds
from roboglot.model.components.system.link import Link
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.geometry import STILL, Twist


class LinkedBase(Base):
    """Drives at velocities alone; a driver whose robot lets single wheels be turned says so itself."""

    wheels = "the wheels of this robot cannot be turned one by one"  # why not

    def __init__(self, link: Link) -> None:
        self._link = link

    @property
    def refusal(self) -> Refused | None:
        return self._link.refusal

    def check(self, twist: Twist) -> None:
        """Raises InvalidGoal for what is no velocity, Unconnected for one that would not reach the robot."""
        if not all(map(math.isfinite, (twist.x, twist.y, twist.yaw))):
            raise InvalidGoal("a velocity is finite")
        if twist != STILL:
            self._link.require()

    def set_wheel_speeds(self, speeds: WheelSpeeds) -> None:
        if speeds != WheelSpeeds():
            raise Refused(self.wheels)
        self.set_velocity(STILL)

    @property
    def wheel_speeds(self) -> WheelSpeeds:
        return WheelSpeeds()
