"""Gaits of legged robots with their speeds and footfall. A vendor's numbers live in that vendor's door."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from roboglot.model.geometry import Twist
from roboglot.values import dataclass

FOOT_LIFT_MIN, FOOT_LIFT_MAX = 0.005, 0.10  # m


class Gait(StrEnum):
    """Gait of a legged robot."""

    TROT_SLOW = "slow trot"
    TROT_MEDIUM = "medium trot"
    TROT_FAST = "fast trot"
    TROT_ADAPTIVE = "adaptive trot"
    TROT_PASSIVE = "passive trot"  # yields to a pull: walking on a leash
    BOUND = "bound"  # front legs, then hind legs
    PRONK = "pronk"  # all four legs at once
    HOP = "hop"
    THREE_LEGS = "three legs"
    SPIN = "spin"
    FOLLOW = "follow"
    BALLET = "ballet"
    STAIRS = "stairs"
    SLOPE = "slope"
    RUN = "run"


@dataclass(frozen=True, slots=True)
class GaitSpec:
    """``lowest`` and ``highest``: the velocities that it can walk, axis by axis (m/s, rad/s).

    ``steps``: footfalls of one leg per second; ``bounce`` (m) and ``rock`` (rad): how far the body swings up and down,
    and in pitch, while walking.
    """

    lowest: Twist
    highest: Twist
    steps: float = 2.5
    bounce: float = 0.004
    rock: float = 0.0

    def clamp(self, twist: Twist) -> Twist:
        """Return the velocity, limited axis by axis to what the gait can walk."""
        low, high = self.lowest, self.highest
        return Twist(
            max(low.x, min(high.x, twist.x)), max(low.y, min(high.y, twist.y)), max(low.yaw, min(high.yaw, twist.yaw))
        )


def _even(x: float, y: float, yaw: float, **more: float) -> GaitSpec:
    """Return a gait with the same speeds to both sides."""
    return GaitSpec(Twist(-x, -y, -yaw), Twist(x, y, yaw), **more)


# Speeds of the trots, bound, pronk and the leash are the CyberDog 2's; the others are undocumented: estimates.
GAITS: Mapping[Gait, GaitSpec] = {
    Gait.TROT_SLOW: _even(0.6, 0.2, 1.3, steps=2.0),
    Gait.TROT_MEDIUM: _even(1.2, 0.4, 2.25, steps=2.8),
    Gait.TROT_FAST: GaitSpec(Twist(-1.2, -0.55, -2.5), Twist(1.6, 0.55, 2.5), steps=3.4, bounce=0.008),
    Gait.TROT_ADAPTIVE: GaitSpec(Twist(-1.2, -0.6, -2.5), Twist(1.6, 0.6, 2.5), steps=2.8),
    Gait.TROT_PASSIVE: _even(0.65, 0.4, 0.8, steps=2.0),
    Gait.BOUND: _even(0.3, 0.3, 1.5, steps=2.0, bounce=0.02, rock=0.12),
    Gait.PRONK: GaitSpec(Twist(-0.1, -0.15, -0.5), Twist(0.2, 0.15, 0.5), steps=1.6, bounce=0.03),
    Gait.HOP: _even(0.3, 0.2, 0.5, steps=1.6, bounce=0.025),
    Gait.THREE_LEGS: _even(0.2, 0.1, 0.5, steps=1.5, bounce=0.01, rock=0.04),
    Gait.SPIN: _even(0.2, 0.2, 4.0, steps=3.4),
    Gait.FOLLOW: _even(1.2, 0.4, 2.25, steps=2.8),
    Gait.BALLET: _even(0.3, 0.2, 0.8, steps=1.5, bounce=0.015),
    Gait.STAIRS: _even(0.4, 0.15, 0.6, steps=1.5, bounce=0.01),
    Gait.SLOPE: _even(0.5, 0.2, 0.8, steps=2.0),
    Gait.RUN: GaitSpec(Twist(-1.2, -0.55, -2.5), Twist(1.6, 0.55, 2.5), steps=3.8, bounce=0.015, rock=0.03),
}
