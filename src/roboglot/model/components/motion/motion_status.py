"""Motion flags of the body: tilt, slip, impacts, lifting; from IMU, wheels and contacts."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.errors import Refused
from roboglot.model.robot import Robot
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class MotionFlags:
    """Current flags; an impact is held a moment longer, so that slow readers see it."""

    static: bool = True  # neither moving nor turning
    uphill: bool = False  # driving up a slope
    downhill: bool = False  # driving down a slope
    sliding: bool = False  # moving down a slope without being driven
    picked_up: bool = False  # the wheels have no contact
    slipping: bool = False  # body and wheels disagree on the speed
    impact_x: bool = False  # a blow along the body's x, y, z
    impact_y: bool = False
    impact_z: bool = False
    rolled_over: bool = False  # lies on a side or upside down
    static_on_slope: bool = False


class MotionStatus(Component):
    """Motion as sensed by the robot itself."""

    @property
    @abstractmethod
    def flags(self) -> MotionFlags:
        """Current state."""


def check_on_floor(robot: Robot) -> None:
    """Raise Refused if the robot senses that it is held up or overturned, so that it can neither walk nor drive."""
    flags = robot[MotionStatus].flags if MotionStatus in robot else None
    if flags is not None and flags.rolled_over:
        raise Refused("the robot lies on its side")
    if flags is not None and flags.picked_up:
        raise Refused("the robot is held up: it has no floor under it")
