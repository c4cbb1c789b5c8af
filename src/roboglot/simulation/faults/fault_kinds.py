"""Kinds of faults: one function each, which begins the fault and returns a function that ends it.

The functions' keyword parameters are the fault's options.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Protocol, TypeVar

import numpy as np

from roboglot.model.components.component import Component
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.sensing.bumper import Bumper
from roboglot.model.components.sensing.cliff import Cliff
from roboglot.model.components.sensing.depth_camera import DepthCamera
from roboglot.model.components.sensing.gps import Gps
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.network import Network
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.model.stage import Stage
from roboglot.simulation.building.blueprint import SHAFT_WALL
from roboglot.simulation.building.building import Building
from roboglot.simulation.building.lift import LiftCar
from roboglot.simulation.components.energy.battery import SimulatedBattery
from roboglot.simulation.components.logistics.cargo import SimulatedCargo
from roboglot.simulation.components.logistics.jack import SimulatedJack
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.motion.emergency_stop import SimulatedEmergencyStop
from roboglot.simulation.components.sensing.bumper import SimulatedBumper
from roboglot.simulation.components.sensing.cliff import SimulatedCliff
from roboglot.simulation.components.sensing.depth_camera import SimulatedDepthCamera
from roboglot.simulation.components.sensing.gps import SimulatedGps
from roboglot.simulation.components.sensing.lidar import SimulatedLidar
from roboglot.simulation.components.sensing.range_sensor import SimulatedRangeSensors
from roboglot.simulation.components.system.disk import SimulatedDisk
from roboglot.simulation.components.system.network import SimulatedNetwork
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.truth import Truth
from roboglot.values import dataclass

Undo = Callable[[], object]
C = TypeVar("C", bound=Component)
DELAY_MAX = 60.0  # s: the longest delay of answers
ASIDE_MAX = 100.0  # m by which a dock is moved at most
KIDNAP_TRIES = 400
KIDNAP_DISTANCE = 4.0  # m at least


class FragileWorld(Protocol):
    """Part of a world that faults need."""

    @property
    def description(self) -> WorldDescription:
        """Description as in its file."""

    @property
    def building(self) -> Building:
        """Docks, shelves, the lift."""

    @property
    def own_stage(self) -> Stage:
        """Stage by which faults move and place things."""

    @property
    def truth(self) -> Truth:
        """Ground truth of the world."""

    @property
    def robots(self) -> Mapping[str, Robot]:
        """All robots by name."""

    @property
    def time(self) -> float:
        """Robot time of the last tick, s."""

    def robot(self, name: str) -> Robot:
        """Return one robot. Raises NotFound."""

    def chance(self, purpose: str) -> np.random.Generator:
        """Return random numbers for one purpose."""


@dataclass(frozen=True, slots=True)
class Target:
    """The world, and the name of the affected robot (None: the building)."""

    world: FragileWorld
    name: str | None

    def part(self, interface: type[Component], simulated: type[C]) -> C:
        """Return the robot's simulated component. Raises ComponentMissing."""
        assert self.name is not None
        component = self.world.robot(self.name)[interface]
        assert isinstance(component, simulated)
        return component

    @property
    def lift(self) -> LiftCar:
        """The building's lift. Raises ValueError if there is none."""
        if self.world.building.lift is None:
            raise ValueError("this world has no lift")
        return self.world.building.lift


@dataclass(frozen=True, slots=True)
class FaultRecipe:
    """Recipe of a kind; ``many``: several may be active at once."""

    begin: Callable[..., Undo]
    of_robot: bool = True
    many: bool = False


KINDS: dict[str, FaultRecipe] = {}


def _kind(*, of_robot: bool = True, many: bool = False) -> Callable[[Callable[..., Undo]], Callable[..., Undo]]:
    """Register a function under its own name."""

    def register(begin: Callable[..., Undo]) -> Callable[..., Undo]:
        KINDS[begin.__name__] = FaultRecipe(begin, of_robot, many)
        return begin

    return register


def _nothing() -> None:
    """Do nothing, for faults that cannot be undone."""


@_kind()
def low_battery(target: Target, *, charge: float = 0.10) -> Undo:
    battery = target.part(Battery, SimulatedBattery)
    before = battery.state.percentage
    battery.set_charge(charge)
    return lambda: battery.set_charge(before)


@_kind()
def lost_localization(
    target: Target, *, x: float | None = None, y: float | None = None, degrees: float = 0.0, floor: int | None = None
) -> Undo:
    """Carried off: without x and y to some free place a few metres away."""
    assert target.name is not None
    world = target.world
    if x is not None and y is not None:
        world.own_stage.place(target.name, Pose(x, y, math.radians(degrees)), floor)
        return _nothing
    here, random = world.truth.pose_of(target.name), world.chance("lost_localization")
    storey = world.description.floors[world.truth.floor_of(target.name)]
    for _ in range(KIDNAP_TRIES):
        x, y, yaw = random.random(3).tolist()
        spot = Pose(
            storey.origin[0] + storey.size[0] * x, storey.origin[1] + storey.size[1] * y, math.tau * (yaw - 0.5)
        )
        if spot.distance_to(here) >= KIDNAP_DISTANCE and world.truth.has_room(target.name, spot):
            world.own_stage.place(target.name, spot)
            return _nothing
    raise ValueError(f"there is no other place for {target.name} on this floor")


@_kind(many=True)
def blocked_path(target: Target, *, ahead: float = 1.0, width: float = 0.6, height: float = 1.0) -> Undo:
    assert target.name is not None
    world, pose = target.world, target.world.truth.pose_of(target.name)
    number = world.own_stage.add_obstacle(
        pose.compose(Pose(ahead)), (width, width, height), world.truth.floor_of(target.name)
    )
    return lambda: world.own_stage.remove_obstacle(number)


@_kind()
def dock_dead(target: Target) -> Undo:
    return _switch(target.part(Battery, SimulatedBattery), "unfed", True)


@_kind(of_robot=False)
def dock_not_found(target: Target, *, dock: int = 0, floor: int = 0, aside: float = 1.5) -> Undo:
    building = target.world.building
    if not (0 <= floor < len(building.docks) and 0 <= dock < len(building.docks[floor])):
        raise ValueError(f"there is no dock {dock} on floor {floor}")
    if abs(aside) > ASIDE_MAX:
        raise ValueError(f"a dock can be moved by up to {ASIDE_MAX:g} m")
    before = building.docks[floor][dock]
    building.move_dock(before.compose(Pose(0.0, aside)), dock, floor)
    return lambda: building.move_dock(before, dock, floor)


@_kind(of_robot=False)
def lift_out_of_service(target: Target) -> Undo:
    lift = target.lift
    lift.take_out_of_service(True)
    return lambda: lift.take_out_of_service(False)


@_kind(of_robot=False)
def lift_occupied(target: Target, *, people: int = 3) -> Undo:
    lift = target.lift
    lift.passengers.board(lift, people)
    return lambda: lift.passengers.board(lift, 0)


@_kind(of_robot=False)
def lift_door_blocked(target: Target, *, floor: int | None = None) -> Undo:
    lift, world = target.lift, target.world
    doorway = lift.frame.compose(Pose((lift.section.size[0] + SHAFT_WALL) / 2))
    number = world.own_stage.add_obstacle(doorway, (0.3, 0.3, 0.8), lift.floor if floor is None else floor)
    return lambda: world.own_stage.remove_obstacle(number)


@_kind()
def motor_fault(target: Target, *, wheel: str = "front_left") -> Undo:
    base = target.part(Base, SimulatedBase)
    base.wheels.kill(frozenset({wheel}))
    return lambda: base.wheels.kill(frozenset())


@_kind()
def lidar_gone(target: Target) -> Undo:
    return _switch(target.part(Lidar, SimulatedLidar), "silent", True)


@_kind()
def depth_camera_gone(target: Target) -> Undo:
    return _switch(target.part(DepthCamera, SimulatedDepthCamera), "connected", False)


@_kind()
def range_sensor_gone(target: Target, *, sensor: str | None = None) -> Undo:
    """Silence the named sensor, or the first."""
    part = target.part(RangeSensors, SimulatedRangeSensors)
    return _switch(part, "silent", frozenset({_one_of("sensor", sensor or part.names[0], part.names)}))


@_kind()
def gps_gone(target: Target) -> Undo:
    return _switch(target.part(Gps, SimulatedGps), "jammed", True)


@_kind()
def cliff(target: Target, *, zone: str = "front") -> Undo:
    sensor = target.part(Cliff, SimulatedCliff)
    return _switch(sensor, "fooled", frozenset({_one_of("zone", zone, sensor.zones)}))


@_kind()
def bumper_stuck(target: Target, *, zone: str = "front") -> Undo:
    bumper = target.part(Bumper, SimulatedBumper)
    return _switch(bumper, "stuck", frozenset({_one_of("zone", zone, bumper.zones)}))


@_kind()
def emergency_stop(target: Target) -> Undo:
    stop = target.part(EmergencyStop, SimulatedEmergencyStop)
    stop.press(True)
    return lambda: stop.press(False)


@_kind()
def brake_released(target: Target) -> Undo:
    stop = target.part(EmergencyStop, SimulatedEmergencyStop)
    stop.release_brake(True)
    return lambda: stop.release_brake(False)


@_kind()
def wifi_loss(target: Target) -> Undo:
    return _switch(target.part(Network, SimulatedNetwork), "jammed", True)


@_kind()
def slow_answers(target: Target, *, seconds: float = 2.0) -> Undo:
    if not 0.0 < seconds <= DELAY_MAX:
        raise ValueError(f"answers can be late by more than 0 and up to {DELAY_MAX:g} s")
    return _switch(target.part(Network, SimulatedNetwork), "delay", seconds)


@_kind()
def full_disk(target: Target) -> Undo:
    disk = target.part(Disk, SimulatedDisk)
    return _switch(disk, "rubbish", disk.size)


@_kind()
def box_jammed(target: Target, *, box: int = 0) -> Undo:
    cargo = target.part(Cargo, SimulatedCargo)
    cargo.jam(box, True)
    return lambda: cargo.jam(box, False)


@_kind()
def hand_in_box(target: Target, *, box: int = 0) -> Undo:
    cargo = target.part(Cargo, SimulatedCargo)
    cargo.hold_hand_into(box, True)
    return lambda: cargo.hold_hand_into(box, False)


@_kind()
def jack_jammed(target: Target) -> Undo:
    return _switch(target.part(Jack, SimulatedJack), "jammed", True)


def _switch(part: object, attribute: str, value: object) -> Undo:
    """Set an attribute; return a function that restores its value."""
    before = getattr(part, attribute)
    setattr(part, attribute, value)
    return lambda: setattr(part, attribute, before)


def _one_of(what: str, name: str, names: tuple[str, ...]) -> str:
    if name not in names:
        raise ValueError(f"a {what} is one of {', '.join(names)}, not {name!r}")
    return name
