"""Locks the wheels of a robot that fell through the floor, until it is put elsewhere."""

from __future__ import annotations

from roboglot.model.errors import Refused
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.building.floor_edges import FloorEdges
from roboglot.simulation.components.motion.base import SimulatedBase

FALLEN_BELOW = -0.1  # m under its floor
FALLEN = "fallen"


class FallGuard:
    """Guard that watches the hull's height; a robot held by hand or on the lift's car has not fallen."""

    def __init__(self, hull: Hull, base: SimulatedBase, footing: FloorEdges) -> None:
        self._hull, self._base, self._footing = hull, base, footing
        self.duty = hull.edges.call(Duty())

    def sense(self, _stamp: float, _seconds: float) -> None:
        """Check the height after every tick near an edge of the floor."""
        hull = self._hull
        if not hull.edges.near:
            self.duty.end()
        if hull.rise < FALLEN_BELOW and hull.hand is None and not self._footing.carries(hull.elevation):
            self._base.locks.lock(FALLEN, Refused("the robot fell down"))
            self._base.cut()

    def displaced(self) -> None:
        """Unlock the wheels: the robot was put elsewhere."""
        self._base.locks.unlock(FALLEN)


def _fit(fit: Fitting) -> FallGuard:
    return FallGuard(fit.hull, fit.get(SimulatedBase), fit.world.building.footing)


PART = Part(
    name="fall_guard",
    fit=_fit,
    after=("base", "odometry"),
    sense=FallGuard.sense,
    displaced=FallGuard.displaced,
    duty=lambda guard: guard.duty,
)
