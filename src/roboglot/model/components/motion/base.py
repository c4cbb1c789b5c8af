"""The drive, on wheels or legs, that moves base_link over the floor."""

from __future__ import annotations

from abc import abstractmethod

from msgspec import Struct

from roboglot.model.components.component import Component
from roboglot.model.errors import Blocked, Refused
from roboglot.model.geometry import STILL, Twist, written
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseLimits:
    """Limits of the drive: top twist (x and y share ``twist.x``), accelerations in m/s2 and rad/s2.

    Not ``holonomic`` (a differential drive): it cannot move sideways, and ``set_velocity`` ignores ``y``.
    """

    twist: Twist
    linear_acceleration: float
    angular_acceleration: float
    holonomic: bool = True


class WheelSpeeds(Struct, frozen=True, gc=False):
    """Four mecanum wheels, rad/s, positive drives forward."""

    front_left: float = 0.0
    front_right: float = 0.0
    rear_left: float = 0.0
    rear_right: float = 0.0

    def __str__(self) -> str:
        return written(self.front_left, self.front_right, self.rear_left, self.rear_right)


class Base(Component):
    """Keeps the last velocity until the next command. Only actions that hold BASE call it; doors use Driving.

    ``built``: limits of its build; ``limits``: those in force, which clients may set lower.
    """

    built: BaseLimits
    limits: BaseLimits

    @property
    def delay(self) -> float:
        """Latency from a command to its effect in odometry, s, beyond the base's inertia; 0 for a local base."""
        return 0.0

    @property
    def refusal(self) -> Refused | None:
        """Return the reason why the base would refuse to drive now (a button, a cable), or None."""
        return None

    @property
    def limits_refusal(self) -> Refused | None:
        """Return the reason why other limits would not hold now, or None: a real robot's own skill moves it."""
        return None

    def check_free(self, command: Twist | WheelSpeeds) -> None:
        """Raise the error that would abort ``command``: Collided if the hull touches something on that side."""
        return

    def hindrance(self, command: Twist | WheelSpeeds) -> Blocked | None:
        """Return what keeps the robot from ``command`` without contact (emergency braking, a cliff), or None.

        A hindered base still turns as commanded; a planner may look for a way around.
        """
        return None

    @abstractmethod
    def set_velocity(self, twist: Twist) -> None:
        """Drive at ``twist`` (base_link; cut to the limits, reached by the limits' accelerations)."""

    def brake_hard(self) -> None:
        """Stop as fast as the drive can, exceeding the limits' accelerations where it is able to."""
        self.set_velocity(STILL)

    @abstractmethod
    def set_wheel_speeds(self, speeds: WheelSpeeds) -> None:
        """Turn the wheels at these speeds; the body follows by their kinematics."""

    @property
    @abstractmethod
    def wheel_speeds(self) -> WheelSpeeds:
        """Current speeds of the wheels."""

    @property
    @abstractmethod
    def velocity(self) -> Twist:
        """Current velocity of base_link as the wheels measure it, m/s and rad/s."""
