"""The model's ``Stage`` on the physics of one world."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from roboglot.model.clock import Clock
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.interaction.armor import PlatePlace
from roboglot.model.components.sensing.touch import Touch, TouchKind
from roboglot.model.errors import NotFound, Refused
from roboglot.model.geometry import Point, Pose, Vector3
from roboglot.model.perception import TagKind
from roboglot.model.sound import Sound
from roboglot.model.stage import ActiveFault, FaultKind, FloorPlan, HungTag, Obstacle, Placed, Stage
from roboglot.simulation.building.blueprint import Solid, SolidKind, person_solid
from roboglot.simulation.building.cards import Card, PrintedTag
from roboglot.simulation.building.outline import plan_of
from roboglot.simulation.components.energy.battery import SimulatedBattery
from roboglot.simulation.components.interaction.armor import SimulatedArmor
from roboglot.simulation.components.motion.emergency_stop import SimulatedEmergencyStop
from roboglot.simulation.components.motion.legs import SimulatedLegs
from roboglot.simulation.components.sensing.adapter import SimulatedSensorAdapters
from roboglot.simulation.components.sensing.touch import SimulatedTouch
from roboglot.simulation.people.stage_people import Actor
from roboglot.simulation.sound.sound import Source
from roboglot.simulation.world.description import Person
from roboglot.simulation.world.description_checks import tag_problem
from roboglot.simulation.world.environment import Environment
from roboglot.simulation.world.placing import Places
from roboglot.simulation.world.population import Population
from roboglot.simulation.world.saving import snapshot, world_toml
from roboglot.simulation.world.truth import Truth

if TYPE_CHECKING:
    from roboglot.simulation.faults.faults import Faults


TAG_HEIGHT_MAX = 5.0  # m
TAG_SIZE_MIN, TAG_SIZE_MAX = 0.02, 2.0  # m, as in world files
LIFTED_MAX = 10.0  # m up or down
BLOW_MAX, PULL_MAX = 500.0, 1000.0  # N s, N along each axis: what is far stronger would break the physics of all robots
AWAY_MAX = 10_000.0  # m from the world's origin, as in world files
LOUDNESS_MAX = 100.0


class WorldStage(Stage):
    """Stage of one world."""

    def __init__(
        self, population: Population, environment: Environment, clock: Clock, faults: Callable[[], Faults]
    ) -> None:
        self._population, self._environment, self._clock, self._faults = population, environment, clock, faults
        self._physics = population.physics

    @property
    def seed(self) -> int:
        return self._environment.chances.seed

    def reseed(self, seed: int) -> None:
        self._environment.chances.reseed(seed)

    @property
    def robots(self) -> Sequence[Placed]:
        return [Placed(name, hull.pose, hull.floor) for name, hull in self._population.hulls.items()]

    @property
    def people(self) -> Sequence[Placed]:
        return [Placed(walker.key, walker.pose, walker.floor) for walker in self._population.walkers]

    @property
    def things(self) -> Sequence[Placed]:
        world = self._environment.description
        floors = {section.name: number for number, floor in enumerate(world.floors) for section in floor.things}
        return [
            Placed(thing.name, Pose(float(thing.position[0]), float(thing.position[1])), floors[thing.name])
            for thing in self._environment.things
        ]

    @property
    def obstacles(self) -> Sequence[Obstacle]:
        boxes = self._physics.obstacles.items()
        return [Obstacle(number, solid.pose, solid.size, floor) for number, (floor, solid) in boxes]

    @property
    def tags(self) -> Sequence[HungTag]:
        return [
            HungTag(number, tag.kind, tag.text, tag.card.pose, floor, tag.card.height, tag.card.size)
            for number, (floor, tag) in self._physics.props.tags.items()
        ]

    @property
    def floors(self) -> Sequence[FloorPlan]:
        world = self._environment.description
        return [plan_of(world, number) for number in range(len(world.floors))]

    def world_file(self) -> str:
        return world_toml(snapshot(self._population, self._environment))

    def place(self, name: str, pose: Pose, floor: int | None = None) -> None:
        hull = self._population.hull(name)
        floor = hull.floor if floor is None else floor
        self._check_inside(pose, floor)
        if obstacle := Truth(self._population, self._environment).in_the_way(name, pose, floor):
            raise Refused(f"{name} cannot stand at ({pose.x:g}, {pose.y:g}) on floor {floor}: {obstacle} is in the way")
        hull.place(pose, floor)
        self._environment.sight.moved()
        if name in self._population.simulated:
            self._population.simulated[name].displaced()

    def reset(self, name: str) -> None:
        self.refuse_reset(name)
        hull, (pose, floor) = self._population.hull(name), self._population.starts[name]
        for fault in self._faults().active:
            if fault.robot == name:
                self._faults().clear(fault.number)
        hull.lift(None)
        hull.leash = None
        self.place(name, pose, floor)
        if (battery := self._population.find(name, SimulatedBattery)) is not None:
            battery.reset()
        if (stop := self._population.find(name, SimulatedEmergencyStop)) is not None:
            stop.reset()
        if (legs := self._population.find(name, SimulatedLegs)) is not None:
            legs.reset()

    def refuse_reset(self, name: str) -> None:
        pose, floor = self._population.starts[name]
        if obstacle := Truth(self._population, self._environment).in_the_way(name, pose, floor):
            raise Refused(f"{name} cannot go back to its start: {obstacle} is in the way")

    def lift(self, name: str, height: float = 0.3) -> None:
        self._population.hull(name).lift(_bounded("height", "m", LIFTED_MAX, height)[0])

    def let_go(self, name: str) -> None:
        self._population.hull(name).lift(None)

    def push(self, name: str, impulse: Vector3) -> None:
        blow = _bounded("an impulse along an axis", "N s", BLOW_MAX, impulse.x, impulse.y, impulse.z)
        self._population.hull(name).push(*blow)

    def pull(self, name: str, force: Point) -> None:
        along, across = _bounded("a force along an axis", "N", PULL_MAX, force.x, force.y)
        self._population.hull(name).leash = along, across

    def roll_over(self, name: str, roll: float = math.pi) -> None:
        self._population.hull(name).overturn(_bounded("roll", "rad", math.tau, roll)[0])

    def touch(self, name: str, kind: TouchKind = TouchKind.SINGLE) -> None:
        self._population.part(name, SimulatedTouch, Touch).touch(TouchKind(kind))

    def plug_in(self, name: str, wire: bool = True) -> None:
        self._population.part(name, SimulatedBattery, Battery).plug(wire)

    def touch_plate(self, name: str, place: PlatePlace) -> None:
        armor = self._population.find(name, SimulatedArmor)
        if armor is None:
            raise NotFound(f"{name} has no armor")
        armor.touch(place)

    def apply_voltage(self, name: str, adapter: int, port: int, voltage: float) -> None:
        adapters = self._population.find(name, SimulatedSensorAdapters)
        if adapters is None:
            raise NotFound(f"{name} has no sensor adapters")
        adapters.apply(adapter, port, voltage)

    def person(self, name: str) -> Actor:
        return Actor(self._population.walker(name), self._check_clear)

    def add_person(self, pose: Pose, floor: int = 0, name: str = "") -> str:
        self._check_inside(pose, floor)
        self._check_clear(person_solid(Person(path=((pose.x, pose.y),)), pose), floor)
        name = self._population.add_walker(pose, floor, name).key
        self._environment.sight.moved()
        return name

    def remove_person(self, name: str) -> None:
        walker = self._population.walker(name)
        if any(gadget.wearer is walker for gadget in self._environment.gadgets.all()):
            raise ValueError(f"{name} wears a gadget that robots may be bound to")
        self._population.remove_walker(name)
        self._environment.sight.moved()

    def move_thing(self, name: str, position: Vector3) -> None:
        place = _bounded("a coordinate", "m", AWAY_MAX, position.x, position.y, position.z)
        self._environment.things[name].put(np.array(place))

    def add_obstacle(self, pose: Pose, size: tuple[float, float, float] = (0.4, 0.4, 1.0), floor: int = 0) -> int:
        self._check_inside(pose, floor)
        self._check_clear(Solid(SolidKind.FURNITURE, pose, size), floor)
        return self._physics.add_obstacle(pose, size, floor)

    def remove_obstacle(self, number: int) -> None:
        self._physics.remove_obstacle(number)

    def move_obstacle(self, number: int, pose: Pose, floor: int) -> None:
        self._check_inside(pose, floor)
        if number in self._physics.obstacles:
            self._check_clear(replace(self._physics.obstacles[number][1], pose=pose), floor)
        self._physics.move_obstacle(number, pose, floor)

    def add_tag(
        self,
        text: str,
        pose: Pose,
        floor: int = 0,
        *,
        kind: TagKind = TagKind.APRIL,
        height: float = 0.4,
        size: float = 0.16,
    ) -> int:
        self._check_inside(pose, floor)
        if problem := tag_problem(kind, text):
            raise ValueError(f"{problem}, not {text[:50]!r}")
        if not (0.0 <= height <= TAG_HEIGHT_MAX and TAG_SIZE_MIN < size <= TAG_SIZE_MAX):
            raise ValueError(
                f"a tag is {TAG_SIZE_MIN} to {TAG_SIZE_MAX} m large and hangs up to {TAG_HEIGHT_MAX} m high"
            )
        return self._physics.props.hang(PrintedTag(kind, text, Card(pose, height, size)), floor)

    def move_tag(self, number: int, pose: Pose, floor: int) -> None:
        self._check_inside(pose, floor)
        props = self._physics.props
        if number not in props.tags:
            raise NotFound(f"there is no added tag {number}")
        tag = props.tags[number][1]
        props.tags[number] = floor, replace(tag, card=replace(tag.card, pose=pose))

    def remove_tag(self, number: int) -> None:
        self._physics.props.take_down(number)

    def make_sound(self, sound: Sound, at: Point, floor: int = 0, loudness: float = 1.0) -> None:
        self._check_inside(Pose(at.x, at.y), floor)
        if not 0.0 <= loudness <= LOUDNESS_MAX:
            raise ValueError(f"the loudness of a sound is 0 to {LOUDNESS_MAX:g}, not {loudness:g}")
        self._environment.air.emit(Source(sound, at, floor, self._clock.time(), loudness))

    @property
    def fault_kinds(self) -> Sequence[FaultKind]:
        return self._faults().kinds

    @property
    def faults(self) -> Sequence[ActiveFault]:
        return self._faults().active

    def inject_fault(
        self, kind: str, robot: str | None = None, *, duration: float | None = None, **options: object
    ) -> Sequence[ActiveFault]:
        return self._faults().inject(kind, robot, duration=duration, **options)

    def clear_fault(self, number: int | None = None) -> None:
        self._faults().clear(number)

    def _check_inside(self, pose: Pose, floor: int) -> None:
        Places(self._environment.description).check_inside(pose, floor)

    def _check_clear(self, solid: Solid, floor: int) -> None:
        """Raise Refused if a robot stands where something is put: it would be pressed through the floor."""
        if robot := Truth(self._population, self._environment).robot_in(solid, floor):
            raise Refused(f"{robot} stands there")


def _bounded(what: str, unit: str, most: float, *values: float) -> Sequence[float]:
    """Return the values. Raises ValueError beyond ``most`` in either direction, and for what is no number."""
    if not all(abs(value) <= most for value in values):
        raise ValueError(f"{what} is at most {most:.4g} {unit}, not {', '.join(f'{value:g}' for value in values)}")
    return values
