"""Single feet: their positions, the order of their steps, and their landing places.

Knows no gait by name and no vendor's order of legs.
"""

from __future__ import annotations

from enum import StrEnum

from roboglot.model.geometry import Vector3
from roboglot.values import dataclass

FOOTFALLS_MAX = 1000  # of one order
FOOTFALL_SECONDS_MIN = 0.02


class Foot(StrEnum):
    """Feet, in the order of every list here."""

    RIGHT_FRONT = "right front"
    LEFT_FRONT = "left front"
    RIGHT_REAR = "right rear"
    LEFT_REAR = "left rear"


@dataclass(frozen=True, slots=True)
class FootState:
    """``position`` in base_link, m (z: above the floor it stands on); ``grounded``: it carries weight."""

    position: Vector3
    grounded: bool


@dataclass(frozen=True, slots=True)
class Foothold:
    """Landing place of a foot, m from its place below the hip (base_link), and ``lift``, its height on the way."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    lift: float = 0.03


@dataclass(frozen=True, slots=True)
class Footfall:
    """Phase of a gait, in seconds: these feet are on the floor, the others in the air."""

    seconds: float
    down: frozenset[Foot]


TROT = (
    Footfall(0.2, frozenset({Foot.LEFT_FRONT, Foot.RIGHT_REAR})),
    Footfall(0.2, frozenset({Foot.RIGHT_FRONT, Foot.LEFT_REAR})),
)
