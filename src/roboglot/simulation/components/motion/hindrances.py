"""Hindrances of a base: directions that others have barred, and what its hull touches."""

from __future__ import annotations

from roboglot.model.errors import Blocked
from roboglot.model.geometry import Twist

STANDS = 0.01  # m/s; anything slower is standing
GLANCING = 0.1  # cosine between the hull's motion and a contact up to which the hull slides past


class Hindrances:
    """``bars``: who keeps it from driving ahead or behind, and why.

    ``touching``: directions (unit vectors, base_link) in which the hull touches something.
    """

    def __init__(self) -> None:
        self.bars: dict[str, tuple[bool, bool, str]] = {}
        self.touching: tuple[tuple[float, float], ...] = ()

    def bar(self, who: str, *, ahead: bool = False, behind: bool = False, reason: str = "") -> None:
        """Do not drive forwards or backwards, whatever is asked, until ``who`` bars it no more."""
        if ahead or behind:
            self.bars[who] = ahead, behind, reason
        else:
            self.bars.pop(who, None)

    def blocks(self, way: float) -> Blocked | None:
        """Return why it does not drive ``way`` m/s forwards, if it is barred."""
        for who, (ahead, behind, reason) in self.bars.items():
            if (ahead and way > 0.0) or (behind and way < 0.0):
                return Blocked(f"{who} stopped the robot: {reason}")
        return None

    def presses(self, twist: Twist) -> bool:
        """True if this motion leads into what the hull touches; turning on the spot and passing along do not."""
        limit = max(STANDS, GLANCING * twist.speed)
        return any(twist.x * x + twist.y * y > limit for x, y in self.touching)
