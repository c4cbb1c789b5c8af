"""Splits an arc into alternating straights and turns, for robots that do one at a time."""

from __future__ import annotations

from roboglot.model.geometry import Pose, Twist, wrap_angle

SLICE = 0.3  # minimum s of one straight or turn, as a robot needs time to accelerate


class ArcSplitter:
    """Tracks how far straights and turns lag behind the commanded velocity, by odometry."""

    def __init__(self, twist: Twist, now: float, odometry: Pose) -> None:
        self.twist = twist
        self._now, self._pose = now, odometry
        self._lag_x = self._lag_yaw = 0.0  # m and rad
        self._turning = False
        self._until = now

    def turning(self, now: float, odometry: Pose) -> bool:
        """Return True to turn next, False to drive."""
        seconds, moved = now - self._now, odometry.relative_to(self._pose)
        self._now, self._pose = now, odometry
        self._lag_x += self.twist.x * seconds - moved.x
        self._lag_yaw += self.twist.yaw * seconds - wrap_angle(moved.yaw)
        if now >= self._until:
            turning = self._lag_yaw / self.twist.yaw > self._lag_x / self.twist.x
            if turning is not self._turning:
                self._turning, self._until = turning, now + SLICE
        return self._turning
