"""How fast clients let the robot be, until it restarts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from roboglot.model.components.base import Base
from roboglot.model.errors import InvalidGoal
from roboglot.model.events import ModuleRestarted, Rebooted
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot

SPEED_MIN = 0.01  # m/s and rad/s: slower, it would stand


class SpeedLimits:
    """What the drive can do at most, whatever clients set."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._built = robot[Base].limits.twist if Base in robot else Twist()
        self._endings: list[Callable[[], None]] = []

    def start(self) -> None:
        """Forget what was set when the robot restarts."""
        listen = self._robot.events.listen
        self._endings = [listen(kind, lambda _: self.reset()) for kind in (Rebooted, ModuleRestarted)]

    def close(self) -> None:
        """Leave the robot as it was built."""
        for end in self._endings:
            end()
        self.reset()

    def reset(self) -> None:
        """As built."""
        if Base in self._robot:
            self._robot[Base].limits = replace(self._robot[Base].limits, twist=self._built)

    def set(self, *, speed: float | None = None, turning: float | None = None) -> None:
        """Drive no faster than ``speed`` m/s, turn no faster than ``turning`` rad/s. InvalidGoal beyond what it can."""
        base = self._robot[Base]
        x, yaw = base.limits.twist.x if speed is None else speed, base.limits.twist.yaw if turning is None else turning
        if not (SPEED_MIN <= x <= self._built.x and SPEED_MIN <= yaw <= self._built.yaw):
            raise InvalidGoal(f"it can do {self._built.x:g} m/s and {self._built.yaw:g} rad/s, and no less than creep")
        base.limits = replace(base.limits, twist=replace(base.limits.twist, x=x, yaw=yaw))
