"""Passengers in the lift's car or its door, by their places; and people put into it by a fault."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Protocol

from roboglot.model.geometry import Pose
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.building.blueprint import SHAFT_WALL, Solid, SolidKind
from roboglot.simulation.building.props import PASSENGERS_MAX, Props
from roboglot.simulation.people.people import Walker
from roboglot.simulation.world.description import Lift

PERSON_MASS = 75.0  # kg
PERSON_SIZE = (0.35, 0.45, 1.72)  # m
SPOTS = ((-0.25, -0.3), (0.25, 0.3), (-0.25, 0.3), (0.25, -0.3))  # centres, as shares of 1.3 half extents of the car
SILL = 0.05  # m in front of and behind the door that must be free as well


class Car(Protocol):
    """Part of the lift's car that passengers need."""

    @property
    def section(self) -> Lift:
        """Sizes of the lift."""

    @property
    def frame(self) -> Pose:
        """Middle of the car's floor, +x towards its door (world)."""

    @property
    def elevation(self) -> float:
        """Elevation of the car's floor, m."""

    @property
    def floor(self) -> int:
        """Floor of the building nearest to the car."""


class Passengers:
    """Passengers among robots, walkers and boxes; moves only the people added by ``board``."""

    def __init__(self, hulls: Iterable[Hull], walkers: Sequence[Walker], props: Props) -> None:
        self._hulls, self._walkers, self._props = list(hulls), walkers, props
        self._count = 0

    def board(self, lift: Car, count: int) -> None:
        """Set the number of people in the car, facing its door. Raises ValueError."""
        if not 0 <= count <= PASSENGERS_MAX:
            raise ValueError(f"the lift holds 0 to {PASSENGERS_MAX} added people, not {count}")
        for index in range(self._count):
            self._props.remove(f"passenger {index}")
        self._count = count
        self.carry(lift)

    def carry(self, lift: Car) -> None:
        """Carry the passengers with the car."""
        deep, wide = lift.section.size
        above = lift.elevation - self._props.elevation(lift.floor)
        for index, (x, y) in enumerate(SPOTS[: self._count]):
            pose = lift.frame.compose(Pose(x * deep, y * wide))
            self._props.put(f"passenger {index}", lift.floor, Solid(SolidKind.PERSON, pose, PERSON_SIZE, above))

    def load(self, lift: Car) -> float:
        """Return the load of the car, kg."""
        deep, wide = lift.section.size
        load = 0.0
        for hull in self._hulls:
            if abs(hull.elevation - lift.elevation) < 0.5 and self._within(lift, hull.pose, deep / 2, wide / 2):
                load += hull.mass
        for pose in self._standing(lift.floor):
            if self._within(lift, pose, deep / 2, wide / 2):
                load += PERSON_MASS
        return load

    def in_doorway(self, lift: Car, floor: int) -> bool:
        """True if a robot, person or thing obstructs the door on that floor."""
        section = lift.section
        for pose, radius in self._everything(floor):
            seen = pose.relative_to(lift.frame)
            off = abs(seen.x - (section.size[0] + SHAFT_WALL) / 2) - SHAFT_WALL / 2 - SILL
            if off < radius and abs(seen.y) < section.door_width / 2 + radius:
                return True
        return False

    def _everything(self, floor: int) -> Iterator[tuple[Pose, float]]:
        """Yield poses and radii (m) of everything that may obstruct a door."""
        for hull in self._hulls:
            if hull.floor == floor:
                yield hull.pose, hull.body.hull.radius
        for walker in self._walkers:
            if walker.floor == floor:
                yield walker.pose, walker.person.radius
        for solid in self._props.on(floor):
            if solid.kind in (SolidKind.FURNITURE, SolidKind.SHELF):
                yield solid.pose, max(solid.size[:2]) / 2

    def _standing(self, floor: int) -> Iterator[Pose]:
        """Yield the poses of people and objects on a floor."""
        yield from (walker.pose for walker in self._walkers if walker.floor == floor)
        yield from (s.pose for s in self._props.on(floor) if s.kind in (SolidKind.FURNITURE, SolidKind.PERSON))

    @staticmethod
    def _within(lift: Car, pose: Pose, half_x: float, half_y: float) -> bool:
        seen = pose.relative_to(lift.frame)
        return abs(seen.x) <= half_x and abs(seen.y) <= half_y
