"""Contacts of a robot with floor and walls, computed only near edges and near walls.

Far from edges, the level floor is a spring: contacts with the floor and the search for those with walls would take most
of the time of a physics step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from roboglot.kernels.layouts import HULL_ON_SPRING, HULL_REST_Z
from roboglot.simulation.bodies.schedule import Duty

if TYPE_CHECKING:
    from mujoco import MjModel

GRAVITY = 9.81
STANDS, FOOT, HANGS, MOVES = 1, 2, 4, 8  # collision bits
SPRING, DAMPER = 2500.0, 100.0  # 1/s2 and 1/s: stiffness and damping of the floor per kg
SETTLED, LIFTED = 1e-4, 1e-3  # m/s up to which it rests on the floor, and m from which it is off it
NEAR = 0.3  # m beyond the rim
AGAIN = 0.1  # m of motion for which a check holds at least


class Nearness:
    """Distance check between a robot and the building, repeated only after it has moved by the last free distance."""

    def __init__(self, radius: float) -> None:
        self._zone = radius + NEAR  # m from the middle
        self._room: Callable[[float, float, int], float] | None = None
        self._x = self._y = 0.0  # where the distance was last checked
        self._floor = -1
        self._free = 0.0  # m from there
        self._next = -math.inf  # m from there to the nearest
        self._duties: list[Duty] = []
        self.near = True  # before the first check objects may be anywhere

    def call(self, duty: Duty, reach: float = 0.0) -> Duty:
        """Begin ``duty`` whenever the building may be within ``reach`` m of the middle, or near the rim."""
        self._zone = max(self._zone, reach)
        self._duties.append(duty)
        if self.near:
            duty.begin()
        return duty

    def learn(self, room: Callable[[float, float, int], float]) -> None:
        """Check from now on; ``room`` returns the distance from a place to the building, m."""
        self._room, self._floor = room, -1

    def left(self, x: float, y: float, floor: int) -> float:
        """Return the distance (m) that the robot may move until the next ``look``; below 0: none."""
        if floor != self._floor or self._room is None:
            return -1.0
        return self._free - abs(x - self._x) - abs(y - self._y)

    def away(self, x: float, y: float, floor: int) -> float:
        """Return the least distance (m) from a place to the building, by the last check; negative if unknown."""
        if floor != self._floor or self._room is None:
            return -math.inf
        return self._next - abs(x - self._x) - abs(y - self._y)

    def look(self, x: float, y: float, floor: int) -> bool:
        """Update by the robot's place; return whether ``near`` changed."""
        if floor == self._floor and abs(x - self._x) + abs(y - self._y) <= self._free:
            return False
        if self._room is None:
            return False
        self._x, self._y, self._floor = x, y, floor
        self._next = self._room(x, y, floor)
        free = self._next - self._zone
        before, self.near = self.near, free <= AGAIN  # just outside the zone every tick would check again
        self._free = AGAIN if self.near else free
        if self.near and not before:
            for duty in self._duties:
                duty.begin()
        return self.near is not before


class Support:
    """Switches one robot between floor contacts and a spring, without moving it, and wall contacts on and off."""

    def __init__(self, model: MjModel, name: str, mass: float, wheels: list[int], row: memoryview[float]) -> None:
        joint = model.joint(f"{name} z")
        self._model, self._mass, self._wheels = model, mass, wheels
        self._body, self._chassis = model.body(name).id, model.geom(f"{name} chassis").id
        self._joint, self._q, self._v = joint.id, int(joint.qposadr[0]), int(joint.dofadr[0])
        self._row = row  # of the hull
        self._bits = STANDS | MOVES

    @property
    def sprung(self) -> bool:
        """True while the spring supports it."""
        return self._row[HULL_ON_SPRING] != 0.0

    def rest(self, z: float) -> None:
        """Support the robot by a spring, at its present height ``z`` (m)."""
        model = self._model
        self._row[HULL_ON_SPRING], self._row[HULL_REST_Z] = 1.0, z
        model.jnt_stiffness[self._joint] = self._mass * SPRING
        model.dof_damping[self._v] = self._mass * DAMPER
        model.qpos_spring[self._q] = z + GRAVITY / SPRING
        self._meet()

    def lifted(self, z: float) -> bool:
        """True if the robot was moved off the floor or into it."""
        return not -LIFTED <= z - self._row[HULL_REST_Z] <= LIFTED

    def release(self) -> None:
        """Support the robot by contacts again: the floor may end, or a hand lifts it."""
        if self.sprung:
            self._row[HULL_ON_SPRING] = 0.0
            self._model.jnt_stiffness[self._joint] = self._model.dof_damping[self._v] = 0.0
            self._meet()

    def walls(self, near: bool) -> None:
        """Switch the search for contacts with walls and furniture."""
        self._bits = STANDS | MOVES if near else MOVES
        self._meet()

    def _meet(self) -> None:
        foot = 0 if self.sprung else FOOT
        self._model.geom_contype[self._wheels] = foot
        self._model.geom_contype[self._chassis] = self._bits
        self._model.body_contype[self._body] = self._bits | foot
