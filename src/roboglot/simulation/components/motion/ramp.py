"""Present velocity of a base's wheels, and its way to a commanded one."""

from __future__ import annotations

from roboglot.model.geometry import STILL, Twist
from roboglot.simulation.bodies.hull import Hull


class Ramp:
    """Velocity of the wheels. While nothing but time changes it, the kernel that drives the hulls does."""

    def __init__(self, hull: Hull) -> None:
        self._hull, self._now = hull, STILL
        self._goal: Twist | None = None  # of the kernel

    @property
    def now(self) -> Twist:
        """Present velocity (base_link)."""
        if self._goal is not None:
            if self._hull.approaches:
                self._now = self._hull.wheels_velocity
            else:
                self._now, self._goal = self._goal, None
        return self._now

    def set(self, twist: Twist) -> None:
        """Take over from the kernel, with this velocity."""
        self._now, self._goal = twist, None

    def go_on(self, goal: Twist, linear: float, angular: float) -> bool:
        """Let the kernel approach ``goal`` by these steps (m/s, rad/s) a tick, from this one on; False: it cannot."""
        if self._hull.robot_rows.tables.kernels is None or self._hull.tilts:
            return False
        self._hull.approach(goal, linear, angular)
        self._goal = goal
        return True
