"""Motions by number: which can be commanded, under which rule of duration, how fast. Knows no robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum


class Motion(IntEnum):
    """The motions that a body without a dog's legs can truly do, too."""

    EMERGENCY_STOP = 0
    LIE_DOWN = 101
    LIE_DOWN_PASSIVE = 102
    STAND_UP = 111
    WALK_STAND = 112
    TROT_SLOW = 303
    TROT_ADAPTIVE = 304
    TROT_FAST = 305
    TROT_MEDIUM = 308


@dataclass(frozen=True, slots=True)
class Gait:
    """Top velocities of a walk, forwards and backwards alike: m/s along x and y, rad/s about z."""

    x: float
    y: float
    yaw: float
    forward: float = 0.0  # m/s ahead where that differs from astern

    def clamp(self, x: float, y: float, yaw: float) -> tuple[float, float, float]:
        """The velocity cut axis by axis to what the walk can do."""
        return (
            max(-self.x, min(self.forward or self.x, x)),
            max(-self.y, min(self.y, y)),
            max(-self.yaw, min(self.yaw, yaw)),
        )


GAITS: Mapping[int, Gait] = {
    Motion.TROT_SLOW: Gait(0.6, 0.2, 1.3),
    Motion.TROT_ADAPTIVE: Gait(1.2, 0.6, 2.5, forward=1.6),
    Motion.TROT_FAST: Gait(1.2, 0.55, 2.5, forward=1.6),
    Motion.TROT_MEDIUM: Gait(1.2, 0.4, 2.25),
}
# What a robot with a low battery still does.
ALLOWED_ON_LOW_BATTERY = frozenset({Motion.EMERGENCY_STOP, Motion.LIE_DOWN, Motion.LIE_DOWN_PASSIVE, Motion.STAND_UP})
# What leads out of an emergency stop, or into it again.
ALLOWED_WHEN_STOPPED = frozenset({Motion.EMERGENCY_STOP, Motion.STAND_UP})


class CommandType(IntEnum):
    """``cmd_type`` of a servo frame."""

    START = 0
    DATA = 1
    END = 2


class MotionCode(IntEnum):
    """``code`` of 1003 and 1004."""

    DONE = 0
    OTHER_SOURCE = 3001
    STATE = 3003
    UNSUPPORTED = 3008
    PARAMETERS = 3010
    BUSY = 3011
    LOW_BATTERY = 3013
    EXECUTION_TIMEOUT = 3028
    EXECUTION = 3029
    EMERGENCY_STOPPED = 3040
    STUCK = 3041


class SwitchStatus(IntEnum):
    """``status`` of 1003: how the change to the commanded motion stands."""

    NORMAL = 0
    CHANGING = 1
    EMERGENCY_STOPPED = 2
    LOW_BATTERY = 7
