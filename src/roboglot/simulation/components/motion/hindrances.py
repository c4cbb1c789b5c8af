"""Hindrances of a base: directions barred by other components, and contacts of its hull."""

from __future__ import annotations

import math

from roboglot.model.errors import Blocked
from roboglot.model.geometry import Twist
from roboglot.simulation.bodies.schedule import Duty

STANDS = 0.01  # m/s; anything slower is standing
GLANCING = 0.1  # cosine between the hull's motion and a contact up to which the hull slides past


class Hindrances:
    """``bars``: by holder, whether driving ahead and behind is barred, and the reason.

    ``touching``: directions (unit vectors, base_link) in which the hull touches something. ``duty``: the base's.
    ``pace``: speed that obstacles ahead permit, m/s; inf: any.
    """

    def __init__(self, duty: Duty) -> None:
        self._duty = duty
        self.pace = math.inf
        self.bars: dict[str, tuple[bool, bool, str]] = {}
        self.touching: tuple[tuple[float, float], ...] = ()

    def bar(self, who: str, *, ahead: bool = False, behind: bool = False, reason: str = "") -> None:
        """Bar driving forwards or backwards until ``who`` calls this with neither."""
        if ahead or behind:
            self.bars[who] = ahead, behind, reason
            self._duty.begin()
        else:
            self.bars.pop(who, None)

    def limit(self, pace: float, speed: float) -> None:
        """Permit this pace (m/s) from now on, to a base that has this speed (m/s) or is to have it."""
        self.pace = pace
        if speed > pace:
            self._duty.begin()

    def blocks(self, way: float) -> Blocked | None:
        """Return the error for driving ``way`` m/s forwards; None: it is not barred."""
        for who, (ahead, behind, reason) in self.bars.items():
            if (ahead and way > 0.0) or (behind and way < 0.0):
                return Blocked(f"{who} stopped the robot: {reason}")
        return None

    def presses(self, twist: Twist) -> bool:
        """True if this motion leads into a touched obstacle; turning on the spot and sliding past do not."""
        limit = max(STANDS, GLANCING * twist.speed)
        return any(twist.x * x + twist.y * y > limit for x, y in self.touching)
