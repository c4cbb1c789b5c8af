"""Contacts of a robot with its surroundings: floor and walls cost contacts only near edges and near walls.

Far from every edge the level floor is a spring. Contacts with the floor and the search for those with walls were most
of a step of the physics.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from roboglot.simulation.bodies.schedule import Duty

if TYPE_CHECKING:
    from mujoco import MjModel

GRAVITY = 9.81
STANDS, FOOT, HANGS, MOVES = 1, 2, 4, 8  # collision bits
SPRING, DAMPER = 2500.0, 100.0  # 1/s2 and 1/s: stiffness and damping of the floor per kg
SETTLED, LIFTED = 1e-4, 1e-3  # m/s up to which it rests on the floor, and m from which it is off it
NEAR = 0.3  # m beyond the rim
AGAIN = 0.1  # m of motion near an object after which the distance is checked again


class Nearness:
    """Distance check between a robot and the building; repeated only once it has gone as far as there was room."""

    def __init__(self, radius: float) -> None:
        self._zone = radius + NEAR  # m from the middle
        self._room: Callable[[float, float, int], float] | None = None
        self._x = self._y = 0.0  # where the distance was last checked
        self._floor = -1
        self._free = 0.0  # m from there
        self._next = -math.inf  # m from there to the nearest
        self._radius = radius
        self._duties: list[Duty] = []
        self.near = True  # before the first check objects may be anywhere

    def call(self, duty: Duty, reach: float = 0.0) -> Duty:
        """Have ``duty`` begin when it may be within ``reach`` m of the middle, or near the rim."""
        self._zone = max(self._zone, reach)
        self._duties.append(duty)
        if self.near:
            duty.begin()
        return duty

    def learn(self, room: Callable[[float, float, int], float]) -> None:
        """Look from now on; ``room`` answers how far the next one is from a place, m."""
        self._room, self._floor = room, -1

    def left(self, x: float, y: float, floor: int) -> float:
        """Return how far (m) the robot may go from there until the next ``look``; below 0: not at all."""
        if floor != self._floor or self._room is None:
            return -1.0
        return self._free - abs(x - self._x) - abs(y - self._y)

    def gap(self, x: float, y: float, floor: int) -> float:
        """Return the room (m) that a robot at that place has around it at least; less than nothing: that is unknown."""
        if floor != self._floor or self._room is None:
            return -math.inf
        return self._next - self._radius - abs(x - self._x) - abs(y - self._y)

    def look(self, x: float, y: float, floor: int) -> bool:
        """Note that the robot is there now; True if that changed whether something may be near."""
        if floor == self._floor and abs(x - self._x) + abs(y - self._y) <= self._free:
            return False
        if self._room is None:
            return False
        self._x, self._y, self._floor = x, y, floor
        self._next = self._room(x, y, floor)
        free = self._next - self._zone
        before, self.near = self.near, free <= 0.0
        self._free = AGAIN if self.near else free
        if self.near and not before:
            for duty in self._duties:
                duty.begin()
        return self.near is not before


class Support:
    """Switches one robot between contacts and the spring, without moving it, and between walls and none."""

    def __init__(self, model: MjModel, name: str, mass: float, wheels: list[int]) -> None:
        joint = model.joint(f"{name} z")
        self._model, self._mass, self._wheels = model, mass, wheels
        self._body, self._chassis = model.body(name).id, model.geom(f"{name} chassis").id
        self._joint, self._q, self._v = joint.id, int(joint.qposadr[0]), int(joint.dofadr[0])
        self._rest = 0.0  # m: compression of the spring at rest
        self._bits = STANDS | MOVES
        self.sprung = False

    def rest(self, z: float) -> None:
        """Let the floor carry it as a spring, where it stands."""
        model = self._model
        self.sprung, self._rest = True, z
        model.jnt_stiffness[self._joint] = self._mass * SPRING
        model.dof_damping[self._v] = self._mass * DAMPER
        model.qpos_spring[self._q] = z + GRAVITY / SPRING
        self._meet()

    def lifted(self, z: float) -> bool:
        """True if the robot was moved off the floor or into it."""
        return not -LIFTED <= z - self._rest <= LIFTED

    def release(self) -> None:
        """Have it stand on contacts again: the floor may end, or something else carries it."""
        if self.sprung:
            self.sprung = False
            self._model.jnt_stiffness[self._joint] = self._model.dof_damping[self._v] = 0.0
            self._meet()

    def walls(self, near: bool) -> None:
        """Have the physics look for contacts with walls and furniture, or not."""
        self._bits = STANDS | MOVES if near else MOVES
        self._meet()

    def _meet(self) -> None:
        foot = 0 if self.sprung else FOOT
        self._model.geom_contype[self._wheels] = foot
        self._model.geom_contype[self._chassis] = self._bits
        self._model.body_contype[self._body] = self._bits | foot
