"""Speed limits set by clients, until the robot restarts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from roboglot.model.components.motion.base import Base
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal
from roboglot.model.events import ModuleRestarting, Rebooted
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot

CONFIGURED = "slamware.speed_limits"  # the setting that holds the configured m/s and rad/s, or null
SPEED_MIN = 0.01  # m/s and rad/s; below this it would not move


class SpeedLimits:
    """Speed limits of the drive, within those of its build, which a real robot reports once it is connected."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._endings: list[Callable[[], None]] = []

    def start(self) -> None:
        """Set the configured limits; parameters set by clients are forgotten when the robot restarts."""
        listen = self._robot.events.listen
        self.reset()
        self._endings = [listen(kind, lambda _: self.reset()) for kind in (Rebooted, ModuleRestarting)]

    def close(self) -> None:
        """Restore the limits of its build."""
        for end in self._endings:
            end()
        if Base in self._robot:
            self._limit(self._robot[Base].built.twist)

    def reset(self) -> None:
        """Set the configured limits, else those of the build."""
        if Base in self._robot:
            built, (speed, turning) = self._robot[Base].built.twist, self._configured()
            self._limit(Twist(speed or built.x, built.y, turning or built.yaw))

    def _limit(self, twist: Twist) -> None:
        base = self._robot[Base]
        base.limits = replace(base.limits, twist=twist)

    def _configured(self) -> tuple[float | None, float | None]:
        if Settings not in self._robot:
            return None, None
        speed, turning = self._robot[Settings].get(CONFIGURED, (None, None))
        return speed, turning

    def check(self, speed: float | None, turning: float | None) -> None:
        """Raise InvalidGoal for limits beyond those of the drive, Refused if no other ones would hold now."""
        base = self._robot[Base]
        if (refused := base.limits_refusal) is not None:
            raise refused
        x, yaw = base.limits.twist.x if speed is None else speed, base.limits.twist.yaw if turning is None else turning
        built = base.built.twist
        if not (SPEED_MIN <= x <= built.x and SPEED_MIN <= yaw <= built.yaw):
            raise InvalidGoal(f"{SPEED_MIN:g} to {built.x:g} m/s and {SPEED_MIN:g} to {built.yaw:g} rad/s are possible")

    def set(self, *, speed: float | None = None, turning: float | None = None) -> None:
        """Set the limits: ``speed`` m/s, ``turning`` rad/s. Raises what ``check`` does."""
        self.check(speed, turning)
        now = self._robot[Base].limits.twist
        self._limit(Twist(now.x if speed is None else speed, now.y, now.yaw if turning is None else turning))
