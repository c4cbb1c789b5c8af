"""Gel beads in the air: ballistic flight in small steps, each tested exactly against armor plates and all solids.

Knows no blaster.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.support import GRAVITY
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.simulation.world.rays import Rays

FLYING_MAX = 500
LANDED_MAX = 200
FLIGHT_MAX = 5.0  # s

Floats = NDArray[np.float64]


class Target(Protocol):
    """Something with plates that beads can hit."""

    hull: Hull

    def meet(self, origin: Floats, way: Floats) -> tuple[float, str] | None:
        """Return the share of the way (world, m; 0 to 1) to the first plate hit from outside, and the plate's name."""

    def struck(self, plate: str, velocity: Floats) -> None:
        """Report that a bead of this velocity (world, m/s) burst on a plate."""


@dataclass(frozen=True, slots=True)
class Landing:
    """Place where a bead burst (world, m); ``what``: name of the solid, or of robot and plate."""

    x: float
    y: float
    z: float
    what: str


@dataclass(slots=True)
class _Bead:
    position: Floats
    velocity: Floats
    shooter: Hull
    age: float = 0.0


class Beads:
    """All beads of a world."""

    def __init__(self, rays: Rays) -> None:
        self._rays = rays
        self._flying: deque[_Bead] = deque(maxlen=FLYING_MAX)
        self.targets: list[Target] = []
        self.landed: deque[Landing] = deque(maxlen=LANDED_MAX)  # newest last

    @property
    def flying(self) -> int:
        """Number of beads in the air."""
        return len(self._flying)

    @property
    def places(self) -> list[tuple[float, float, float]]:
        """Return the places of the beads in the air (world, m)."""
        return [(float(x), float(y), float(z)) for x, y, z in (bead.position for bead in self._flying)]

    def launch(self, position: Floats, velocity: Floats, shooter: Hull) -> None:
        """Add a bead with this position and velocity (world, m and m/s); it passes through its shooter."""
        self._flying.append(_Bead(position, velocity, shooter))

    def fly(self, seconds: float) -> None:
        """Move all beads on by ``seconds``."""
        for _ in range(len(self._flying)):
            bead = self._flying.popleft()
            if not self._lands(bead, seconds):
                self._flying.append(bead)

    def _lands(self, bead: _Bead, seconds: float) -> bool:
        """Move one bead; return whether its flight is over."""
        way = bead.velocity * seconds
        way[2] -= GRAVITY * seconds**2 / 2
        first = self._rays.meet(bead.position, way, bead.shooter)
        struck: Target | None = None
        for target in self.targets:
            plate = None if target.hull is bead.shooter else target.meet(bead.position, way)
            if plate is not None and (first is None or plate[0] <= first[0]):
                first, struck = plate, target
        if first is not None:
            share, what = first
            x, y, z = (bead.position + share * way).tolist()
            self.landed.append(Landing(x, y, z, f"{struck.hull.name} {what}" if struck else what))
            if struck:
                struck.struck(what, bead.velocity)
            return True
        bead.position = bead.position + way
        bead.velocity[2] -= GRAVITY * seconds
        bead.age += seconds
        return bead.age > FLIGHT_MAX
