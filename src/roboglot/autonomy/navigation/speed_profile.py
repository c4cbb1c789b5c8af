"""Trapezoidal speed profiles: speed by the distance left, and top speed by the duration."""

from __future__ import annotations

import math

from roboglot.values import dataclass

BRAKING_SHARE = 0.8  # of the possible deceleration that plans use; the rest covers the base's lag
APPROACH_GAIN = 6.0  # 1/s; near the goal the speed is this times the remaining distance


def trapezoid_time(distance: float, speed: float, acceleration: float) -> float:
    """Return the time to cover ``distance`` from rest to rest, s."""
    if distance >= speed * speed / acceleration:
        return distance / speed + speed / acceleration
    return 2.0 * math.sqrt(distance / acceleration)


def cruise_speed(distance: float, duration: float, acceleration: float) -> float:
    """Return the lowest top speed with which ``distance`` takes ``duration`` from rest to rest."""
    if duration <= 0:
        return 0.0
    root = (acceleration * duration) ** 2 - 4.0 * acceleration * distance
    return (acceleration * duration - math.sqrt(max(0.0, root))) / 2.0


@dataclass(slots=True)
class Ramp:
    """Speed along one axis towards a goal: rises by the acceleration, falls in time to stop there."""

    top: float
    acceleration: float
    speed: float = 0.0
    gain: float = APPROACH_GAIN

    def step(self, remaining: float, dt: float) -> float:
        """Return the speed for the next ``dt`` seconds with ``remaining`` (>= 0) left."""
        braking = math.sqrt(2.0 * BRAKING_SHARE * self.acceleration * remaining)
        allowed = min(self.top, braking, self.gain * remaining)
        self.speed = min(allowed, self.speed + self.acceleration * dt)
        return self.speed
