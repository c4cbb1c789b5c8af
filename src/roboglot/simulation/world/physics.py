"""MuJoCo's model and data of one world, stepped; hulls, people and obstacles by name. No clock, no components."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Container, Mapping
from functools import lru_cache
from typing import NamedTuple

import mujoco
import numpy as np
from msgspec.structs import replace

from roboglot.kernels.layouts import HULL_FLOOR, HULL_WIDTH, HULL_X, HULL_Y, NEAR, SEEN, SETTLING, STUCK
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Pose
from roboglot.simulation.bodies.body import Body
from roboglot.simulation.bodies.hull import STOREY, Hull, HullContact
from roboglot.simulation.bodies.hull_state import TABLE
from roboglot.simulation.bodies.sleep import RESTS, Sleep, tiny
from roboglot.simulation.bodies.support import LIFTED
from roboglot.simulation.bodies.tables import RobotRows, RobotTables
from roboglot.simulation.building.blueprint import Solid, SolidKind
from roboglot.simulation.building.props import AWAY, OBSTACLES_MAX, Props
from roboglot.simulation.building.terrain import Ground
from roboglot.simulation.building.things import Things
from roboglot.simulation.building.walls import Walls
from roboglot.simulation.people.people import keyed
from roboglot.simulation.people.person_state import STRIDE_MAX
from roboglot.simulation.world.contact_switch import ContactSwitch, rests
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.free_motion import FreeMotion
from roboglot.simulation.world.rays import Rays
from roboglot.simulation.world.scene import TIMESTEP, VISITORS_MAX, build, visitors

LIGHT = 1.0  # kg; a lighter object moves before a bumper is pressed
_compiled = lru_cache(maxsize=8)(build)


def _model_of(world: WorldDescription, bodies: Mapping[str, Body]) -> mujoco.MjModel:
    """Return a copy of the compiled model, which is cached: worlds are reset and reopened."""
    what = replace(world, faults=()), tuple(bodies.items())
    try:
        hash(what)
    except TypeError:  # created by hand, with lists
        return build(*what)
    return copy.copy(_compiled(*what))


class Physics:
    """Physics of one world. Raises BadFile if the world cannot be built."""

    def __init__(self, world: WorldDescription, bodies: Mapping[str, Body]) -> None:
        self._model = _model_of(world, bodies)
        self._data = mujoco.MjData(self._model)
        model = self._model
        self._elevations = [world.elevation(number) for number in range(len(world.floors))]
        self.ground = Ground(world)
        self.tables = RobotTables(len(bodies))
        each_robots_rows = (RobotRows(self.tables, index) for index in range(len(bodies)))
        self.hulls = {
            name: Hull(model, self._data, name, body, self._elevations, self.ground, next(each_robots_rows))
            for name, body in bodies.items()
        }
        self._all_hulls = list(self.hulls.values())
        self._hull_rows = self.tables.table(TABLE, HULL_WIDTH)
        self._state = self._data.qpos, self._data.qvel, self._data.ctrl  # views of the current values
        self._hull_of = {geom: hull for hull in self.hulls.values() for geom in hull.geoms}
        self._hulls_of = np.isin(np.arange(model.ngeom), list(self._hull_of))  # whether a geom belongs to a hull
        self._shape_of = np.full(model.ngeom, -1)  # by geom: the first geom of its robot
        for hull in self.hulls.values():
            self._shape_of[hull.shape] = hull.shape[0]
        names = [model.geom(geom).name for geom in range(model.ngeom)]
        self._docks = {geom for geom, name in enumerate(names) if name.startswith("dock ")}
        people = [walker.body for walker in keyed([floor.people for floor in world.floors])] + visitors()
        self._persons = {int(model.body(person).geomadr[0]) for person in people}
        self._places = self._data.mocap_pos
        self._spots = self._places.data.cast("B").cast("d")  # the same numbers in one row: quicker to write
        self._attitudes = self._data.mocap_quat.data.cast("B").cast("d")
        self._people = {person: _Standing(model, person) for person in people}
        self.people = {person: standing.mocap for person, standing in self._people.items()}
        self.around_people = self._hull_rows, self._places, self._data.mocap_quat
        self.props = Props(model, self._data, self._elevations)
        self.rays = Rays(model, self._data)
        self._car = (model.joint("car").qposadr[0], model.actuator("car").id) if world.lift else None
        self.obstacles: dict[int, tuple[int, Solid]] = {}  # by its number: floor and box
        self._touched: dict[Hull, list[tuple[float, float]]] = {}  # where (world, m)
        self._feet = sum(name.split(" ")[-1] == "foot" for name in names) + sum(len(h.wheels) for h in self._all_hulls)
        self._light = {
            model.geom(f"thing {thing.name}").id
            for floor in world.floors
            for thing in floor.things
            if thing.mass < LIGHT
        }
        self.things = Things(model, self._data, world)
        calm = not (self.ground.uneven or any(floor.things for floor in world.floors))
        self.walls = Walls(world)
        self._free_motion: FreeMotion | None = None
        if calm and self.hulls:
            self._free_motion = FreeMotion(model, self._data, self._hull_rows, self.walls, car=world.lift is not None)
        self._contact_switch = ContactSwitch(model, self._all_hulls, self.props, self._free_motion)
        self._sleep = Sleep(model, self._data)

    def step(self, seconds: float, after_substep: Callable[[float], None] | None = None) -> None:
        """Let ``seconds`` pass with the present controls, and note what touches each hull.

        ``after_substep`` is called after every small step with its length (s), for objects too fast for a whole tick.
        """
        self._contact_switch.look(seconds, touched=self._pressed)
        if after_substep is None and self._contact_switch.off:
            if self._sleep.lasts:
                self.rays.outdate()
                return
            if self._free_motion is not None and self._free_motion.step(round(seconds / TIMESTEP)):
                self.rays.outdate()
                self._see()
                return
        self._step_mujoco(seconds, after_substep)

    def _step_mujoco(self, seconds: float, after_substep: Callable[[float], None] | None = None) -> None:
        """Do MuJoCo's steps; touches last only if they are searched for."""
        if self._touched:
            self._contact_switch.switch(off=False)
        for hull in self._all_hulls:
            if hull.hand is not None:
                hull.handle()
        steps = round(seconds / TIMESTEP)
        if after_substep is None:
            mujoco.mj_step(self._model, self._data, nstep=steps)
        else:
            for _ in range(steps):
                mujoco.mj_step(self._model, self._data)
                after_substep(TIMESTEP)
        self._see()

    @property
    def moves_freely(self) -> bool:
        """True if a kernel may move the robots."""
        return self._free_motion is not None and self._free_motion.loaded

    def course(self) -> Course | None:
        """Return what a kernel needs to do several ticks; None: the next one needs MuJoCo, or there are no kernels."""
        if self._free_motion is None or not self.moves_freely or self._pressed:
            return None
        return Course(self._free_motion, self._sleep, self._contact_switch.known)

    @property
    def _pressed(self) -> bool:
        """True if contacts must be searched for: something presses on a hull, moves at it, or was put there."""
        if not self._touched:
            return False
        return bool(self._data.nefc) or not (all(map(_leans, self._touched)) and self._contact_switch.known)

    def moved(self, *, awake: bool, known: bool) -> None:
        """Note that a kernel moved everything, or (not ``awake``) nothing moves; ``known``: as in the course."""
        self.rays.outdate()
        self._contact_switch.switch(off=True)
        if not known:
            self._contact_switch.note()
        if awake:
            self._sleep.wake()
        for hull, places in self._touched.items():  # it may turn
            seen = (hull.seen_from(*place) for place in places)
            hull.touches = [touch._replace(x=x, y=y) for touch, (x, y) in zip(hull.touches, seen, strict=True)]

    def end(self, stage: int, count: int, seconds: float) -> None:
        """Do the rest of a tick's physics after the kernel has stopped at ``stage`` and returned ``count``."""
        if stage in (NEAR, STUCK):
            self._contact_switch.switch(off=stage == STUCK)
            self._step_mujoco(seconds)
        elif stage == SETTLING:
            self._see()
        elif stage == SEEN:
            self._look(count)

    def load_kernels(self) -> None:
        """Move robots that nothing can touch without MuJoCo from now on."""
        if self._free_motion is not None:
            self._free_motion.load_kernels()
            self.walls.load_kernel()

    def drive(self, seconds: float) -> None:
        """Turn the wheels of all robots as commanded, for the next ``seconds``."""
        if (kernels := self.tables.kernels) is not None and not self.ground.uneven:
            kernels.drive_wheels(self._hull_rows, self._state[2], seconds)
            return
        for hull in self._all_hulls:
            hull.turn_wheels(seconds)

    def _see(self) -> None:
        """Read positions, velocities and touches after a step."""
        positions, velocities, _ = self._state
        kernels = self.tables.kernels
        rests = kernels.all_below(velocities, RESTS) if kernels is not None else tiny(velocities.tolist())
        self._sleep.settle(rests=rests)
        count = -1
        if kernels is not None:
            count = kernels.read_motion(self._hull_rows, positions, velocities, STOREY, LIFTED, self.tables.others)
        self._look(count)

    def _look(self, count: int) -> None:
        """Read the ``count`` hulls that the kernel has left (-1: all of them), and what touches them."""
        hulls, standing = self._all_hulls, self._feet
        if self._touched or self._data.nefc:  # others cannot touch anything
            standing -= sum(len(hull.wheels) for hull in hulls if hull.support.sprung)
        if count >= 0:
            hulls = [hulls[index] for index in self.tables.others[:count].tolist()] if count else []
        if hulls:
            positions, velocities, _ = self._state
            places, rates = positions.tolist(), velocities.tolist()
            for hull in hulls:
                hull.see(places, rates)
            if loose := [hull for hull in hulls if hull.loose]:
                self._note_wheels(loose)
        self._note_touches(standing)

    def _note_wheels(self, loose: list[Hull]) -> None:
        """Update which wheels of tilting hulls touch the ground."""
        touching = set(self._data.contact.geom.ravel().tolist())
        for hull in loose:
            hull.stand(sum(wheel in touching for wheel in hull.wheels) / len(hull.wheels))

    def spots(self) -> dict[int, list[tuple[float, float]]]:
        """Return the places of all robots (world, m) by floor; a floor without robots is missing."""
        rows = self._hull_rows
        places, floors = rows[:, HULL_X : HULL_Y + 1].tolist(), rows[:, HULL_FLOOR].tolist()
        spots: dict[int, list[tuple[float, float]]] = {}
        for (x, y), floor in zip(places, floors, strict=True):
            spots.setdefault(int(floor), []).append((x, y))
        return spots

    def move_person(self, body: str, pose: Pose, floor: int) -> None:
        """Place a person at ``pose`` (world)."""
        person = self._people[body]
        spots, at = self._spots, 3 * person.mocap
        if not (person.there and max(abs(pose.x - spots[at]), abs(pose.y - spots[at + 1])) < STRIDE_MAX):
            self._contact_switch.switch(off=False)
        spots[at], spots[at + 1], spots[at + 2] = pose.x, pose.y, self._elevations[floor] + person.half
        turns, at = self._attitudes, 4 * person.mocap  # a quaternion around the vertical axis
        turns[at], turns[at + 3] = math.cos(pose.yaw / 2), math.sin(pose.yaw / 2)
        turns[at + 1] = turns[at + 2] = 0.0
        if not person.there:
            person.there = True
            self._model.body_conaffinity[person.id] = person.bits

    def remove_person(self, body: str) -> None:
        """Take a person away; ``move_person`` brings them back."""
        person = self._people[body]
        self._places[person.mocap], person.there = AWAY, False
        self._model.body_conaffinity[person.id] = 0

    def spare_person(self, there: Container[str]) -> str:
        """Return the name of a spare person that is not ``there``. Raises ValueError if all are."""
        free = next((body for body in visitors() if body not in there), None)
        if free is None:
            raise ValueError(f"no more than {VISITORS_MAX} people can be added to a world")
        return free

    def add_obstacle(self, pose: Pose, size: tuple[float, float, float], floor: int) -> int:
        """Place one of the spare boxes; return its number. Raises ValueError if none is left or for a bad size."""
        number = next((n for n in range(OBSTACLES_MAX) if n not in self.obstacles), None)
        if number is None:
            raise ValueError(f"no more than {OBSTACLES_MAX} obstacles at a time")
        if not all(0.0 < extent <= 20.0 for extent in size):
            raise ValueError("an obstacle is more than 0 and at most 20 m long")
        self.obstacles[number] = floor, Solid(SolidKind.FURNITURE, pose, size)
        self.props.put(f"obstacle {number}", *self.obstacles[number])
        return number

    def move_obstacle(self, number: int, pose: Pose, floor: int) -> None:
        """Move a box. Raises NotFound."""
        if number not in self.obstacles:
            raise NotFound(f"there is no obstacle {number}")
        self.obstacles[number] = floor, Solid(SolidKind.FURNITURE, pose, self.obstacles[number][1].size)
        self.props.put(f"obstacle {number}", *self.obstacles[number])

    def remove_obstacle(self, number: int) -> None:
        """Remove a box. Raises NotFound."""
        if self.obstacles.pop(number, None) is None:
            raise NotFound(f"there is no obstacle {number}")
        self.props.remove(f"obstacle {number}")

    @property
    def car_lift(self) -> float:
        """Height of the lift's car above the floor of ``parked_at``, m."""
        assert self._car is not None
        return float(self._data.qpos[self._car[0]])

    def drive_car(self, lift: float) -> None:
        """Set the goal of the car's servo, as a height like ``car_lift``, m."""
        assert self._car is not None
        self._data.ctrl[self._car[1]] = lift

    def _note_touches(self, feet: int) -> None:
        """Update the places where anything but a dock presses on each hull, until it is clear of the hull again.

        ``feet``: the number of feet that may stand on floors.
        """
        before = self._touched
        for hull in before:
            hull.touches = []
        self._touched = {}
        data = self._data
        # A caster's contact is frictionless: one constraint. Only a touching hull causes more constraints than contacts
        # (limp legs do, too, at the price of a needless check) or more contacts than feet, and checking is expensive.
        if (not data.nefc or data.nefc <= data.ncon <= feet) and not before:
            return
        geoms, near = data.contact.geom, data.contact.dist <= 0.0
        mine = self._hulls_of[geoms]
        known = [hull.shape[0] for hull in before]
        near |= np.isin(self._shape_of[geoms], known).any(axis=1) if known else False
        pairs = np.flatnonzero(near & mine.any(axis=1))
        if not len(pairs):
            return
        places = data.contact.pos[pairs].tolist()
        distances = data.contact.dist[pairs].tolist()
        for (a, b), (x, y, _), distance in zip(geoms[pairs].tolist(), places, distances, strict=True):
            self._note_touch(a, b, (x, y), distance, before)
            self._note_touch(b, a, (x, y), distance, before)

    def _note_touch(
        self, mine: int, other: int, at: tuple[float, float], distance: float, before: Container[Hull]
    ) -> None:
        touched = self._hull_of.get(mine)
        if touched is None or other in self._docks or (distance > 0.0 and touched not in before):
            return
        if not touched.touches:
            for duty in touched.when_touched:
                duty.begin()
        touched.touches.append(HullContact(*touched.seen_from(*at), other in self._persons, other in self._light))
        self._touched.setdefault(touched, []).append(at)


def _leans(hull: Hull) -> bool:
    """Return whether a touched hull stands, possibly turning, at things that stand as well."""
    return rests(hull) and not any(touch.person for touch in hull.touches)


class Course(NamedTuple):
    """Objects whose arrays a kernel moves on. ``known``: nothing but people has jumped since the last step."""

    free_motion: FreeMotion
    sleep: Sleep
    known: bool


class _Standing:
    """Indices of a person in the model."""

    def __init__(self, model: mujoco.MjModel, name: str) -> None:
        body = model.body(name)
        geom = body.geomadr[0]
        self.id, self.mocap, self.bits = body.id, int(body.mocapid[0]), int(model.geom_conaffinity[geom])
        self.half = float(model.geom_size[geom][:2].sum())  # m: of a capsule, radius and half its straight part
        self.there = False  # whether robots may collide with them
