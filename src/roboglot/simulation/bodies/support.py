"""What carries a robot: where the floor may end it stands on contacts, elsewhere the level floor is a spring.

Contacts cost most of a step of the physics; a robot that rolls far from every edge needs none with the floor.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from roboglot.simulation.bodies.schedule import Duty

GRAVITY = 9.81
FOOT = 2  # the bit of what stands on floors
SPRING, DAMPER = 2500.0, 100.0  # 1/s2 and 1/s, of the floor per kg
SETTLED, LIFTED = 1e-4, 1e-3  # m/s up to which it stands on the floor, and m by which it does not any more
EDGE = 0.3  # m beyond the rim: if the floor ends there, it is looked at in every tick


class EdgeWatch:
    """Whether the floor may end near a robot. Looks again only when it has gone as far as an edge was away."""

    def __init__(self, radius: float) -> None:
        self._zone = radius + EDGE  # m from the middle
        self._room: Callable[[float, float, int], float] | None = None
        self._x = self._y = 0.0  # where it was looked for an edge last
        self._floor = -1
        self._free = -1.0  # m from there without one
        self._duties: list[Duty] = []
        self.near = True  # before it knows where floors end, they may end anywhere

    def call(self, duty: Duty, reach: float = 0.0) -> Duty:
        """Have ``duty`` begin when the floor may end within ``reach`` m of the middle, or near the rim."""
        self._zone = max(self._zone, reach)
        self._duties.append(duty)
        if self.near:
            duty.begin()
        return duty

    def learn(self, room: Callable[[float, float, int], float]) -> None:
        """Look from now on; ``room`` answers how far the floor's end is from a place, m."""
        self._room, self._floor = room, -1

    @property
    def level(self) -> bool:
        """True if all ground is floor that ends where it is known to."""
        return self._room is not None

    def look(self, x: float, y: float, floor: int) -> None:
        """The robot is there now."""
        if floor == self._floor and abs(x - self._x) + abs(y - self._y) <= self._free:
            return
        if self._room is None:
            return
        self._x, self._y, self._floor = x, y, floor
        self._free = self._room(x, y, floor) - self._zone
        before, self.near = self.near, self._free <= 0.0
        if self.near and not before:
            for duty in self._duties:
                duty.begin()


class Support:
    """Switches one robot between contacts and the spring, without moving it."""

    def __init__(self, model: Any, name: str, mass: float, wheels: list[int]) -> None:
        joint = model.joint(f"{name} z")
        self._model, self._mass, self._wheels = model, mass, wheels
        self._joint, self._q, self._v = joint.id, int(joint.qposadr[0]), int(joint.dofadr[0])
        self._rest = 0.0  # where it stands on the spring, m
        self.sprung = False

    def rest(self, z: float) -> None:
        """Let the floor carry it as a spring, where it stands."""
        model = self._model
        self.sprung, self._rest = True, z
        model.jnt_stiffness[self._joint] = self._mass * SPRING
        model.dof_damping[self._v] = self._mass * DAMPER
        model.qpos_spring[self._q] = z + GRAVITY / SPRING
        model.geom_contype[self._wheels] = 0

    def lifted(self, z: float) -> bool:
        """True if something moved it off the floor, or into it."""
        return not -LIFTED <= z - self._rest <= LIFTED

    def release(self) -> None:
        """Have it stand on contacts again: the floor may end, or something else carries it."""
        if self.sprung:
            self.sprung = False
            self._model.jnt_stiffness[self._joint] = self._model.dof_damping[self._v] = 0.0
            self._model.geom_contype[self._wheels] = FOOT
