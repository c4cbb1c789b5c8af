"""Forward and inverse kinematics of wheels: mecanum, or a differential drive with one motor per side."""

from __future__ import annotations

from collections.abc import Callable

from msgspec.structs import replace

from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.geometry import Twist
from roboglot.simulation.bodies.body import BaseSection


def four(wheels: WheelSpeeds) -> tuple[float, float, float, float]:
    """Return the speeds of front left and right, rear left and right, rad/s."""
    return wheels.front_left, wheels.front_right, wheels.rear_left, wheels.rear_right


class Wheels:
    """``radius`` (m): wheel speed to the body's speed; ``lever`` (m): turn rate to the wheels' ground speed.

    ``dead``: wheels (field names of WheelSpeeds) without motor power.
    """

    def __init__(self, section: BaseSection, changed: Callable[[], None] = lambda: None) -> None:
        """``changed`` is called after ``dead`` has changed."""
        self._changed = changed
        self.mecanum = section.drive == "mecanum"
        self.radius = section.wheel_radius
        self.lever = (section.wheel_base + section.track) / 2 if self.mecanum else section.track / 2
        self.dead: frozenset[str] = frozenset()

    def kill(self, wheels: frozenset[str]) -> None:
        """Set the wheels without motor power, which drag; empty: none. Raises ValueError."""
        if wheels - set(WheelSpeeds.__struct_fields__):
            raise ValueError(f"a wheel is one of {', '.join(WheelSpeeds.__struct_fields__)}")
        if not self.mecanum:  # one motor per side
            sides = {wheel.split("_")[1] for wheel in wheels}
            wheels = frozenset(wheel for wheel in WheelSpeeds.__struct_fields__ if wheel.split("_")[1] in sides)
        self.dead = wheels
        self._changed()

    def driven(self, wheels: WheelSpeeds) -> WheelSpeeds:
        """Return the wheel speeds with 0 for dead wheels."""
        return replace(wheels, **dict.fromkeys(self.dead, 0.0))

    def speeds_of(self, twist: Twist) -> WheelSpeeds:
        """Return the wheel speeds (rad/s) of a body moving at ``twist``."""
        turn = self.lever * twist.yaw
        if not self.mecanum:
            left, right = (twist.x - turn) / self.radius, (twist.x + turn) / self.radius
            return WheelSpeeds(left, right, left, right)
        return WheelSpeeds(
            front_left=(twist.x - twist.y - turn) / self.radius,
            front_right=(twist.x + twist.y + turn) / self.radius,
            rear_left=(twist.x + twist.y - turn) / self.radius,
            rear_right=(twist.x - twist.y + turn) / self.radius,
        )

    def motion_of(self, command: Twist | WheelSpeeds) -> Twist:
        """Return the body's twist by a command of either kind."""
        return command if isinstance(command, Twist) else self.twist_of(command)

    def twist_of(self, wheels: WheelSpeeds) -> Twist:
        """Return the body's twist as the mean of four wheels; their differences are slip."""
        fl, fr, rl, rr = four(wheels)
        quarter = self.radius / 4
        if not self.mecanum:
            return Twist((fl + fr + rl + rr) * quarter, 0.0, (-fl + fr - rl + rr) * quarter / self.lever)
        return Twist(
            (fl + fr + rl + rr) * quarter, (-fl + fr + rl - rr) * quarter, (-fl + fr - rl + rr) * quarter / self.lever
        )
