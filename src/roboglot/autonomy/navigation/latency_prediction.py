"""Predicts the pose of a robot behind a slow link after the commands that are under way."""

from __future__ import annotations

from collections import deque

from roboglot.model.clock import Clock
from roboglot.model.components.motion.base import Base
from roboglot.model.geometry import Pose, Twist

COMMANDS_MAX = 256  # commands remembered


class PosePredictor:
    """Predictor for one move, from the commands that odometry does not show yet."""

    def __init__(self, base: Base, clock: Clock) -> None:
        self._base, self._clock = base, clock
        self._commands: deque[tuple[float, Twist]] = deque(maxlen=COMMANDS_MAX)

    def sent(self, twist: Twist) -> None:
        """Note a command sent to the base now."""
        if self._base.delay > 0.0:
            self._commands.append((self._clock.time(), twist))

    def ahead(self, pose: Pose) -> Pose:
        """Return ``pose``, the newest odometry (odom), moved by the commands under way."""
        now, known = self._clock.time(), self._clock.time() - self._base.delay
        while len(self._commands) > 1 and self._commands[1][0] <= known:
            self._commands.popleft()
        ends = [*(begun for begun, _ in self._commands), now][1:]
        for (begun, twist), end in zip(self._commands, ends, strict=True):
            if (seconds := end - max(begun, known)) > 0.0:
                pose = pose.compose(Pose(twist.x * seconds, twist.y * seconds, twist.yaw * seconds))
        return pose
