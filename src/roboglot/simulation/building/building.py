"""Movable parts of the building: docks, shelves and the lift. Places and steps them."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.model.errors import NotFound
from roboglot.model.geometry import Pose
from roboglot.simulation.building.blueprint import dock_solid
from roboglot.simulation.building.floor_edges import FloorEdges
from roboglot.simulation.building.lift import LiftCar
from roboglot.simulation.building.lift_passengers import Passengers
from roboglot.simulation.building.mechanics import Mechanics
from roboglot.simulation.building.shelves import ShelfStand
from roboglot.simulation.people.people import Walker
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.placing import docks_of


class Building:
    """``docks``: fronts by floor (world), +x away from the dock. ``lift``: None if there is none."""

    def __init__(self, world: WorldDescription, physics: Mechanics, walkers: Sequence[Walker]) -> None:
        self._props = physics.props
        self.docks = docks_of(world)
        for floor, docks in enumerate(self.docks):
            for index, front in enumerate(docks):
                self._props.put(f"dock {floor} {index}", floor, dock_solid(front))
        self.shelves = [
            ShelfStand(shelf, number, f"shelf {number} {index}", self._props, world)
            for number, floor in enumerate(world.floors)
            for index, shelf in enumerate(floor.shelves)
        ]
        self.lift: LiftCar | None = None
        if world.lift is not None:
            self.lift = LiftCar(world, physics, Passengers(physics.hulls.values(), walkers, self._props))
        self.footing = FloorEdges(world, self.lift)
        if not physics.ground.uneven:
            for hull in physics.hulls.values():
                hull.edges.learn(self.footing.room)
                hull.walls.learn(physics.walls.room)
                hull.look()

    def move_dock(self, front: Pose, index: int, floor: int) -> None:
        """Move a dock's front to this pose (world). Raises NotFound."""
        if not (0 <= floor < len(self.docks) and 0 <= index < len(self.docks[floor])):
            raise NotFound(f"there is no dock {index} on floor {floor}")
        self.docks[floor][index] = front
        self._props.put(f"dock {floor} {index}", floor, dock_solid(front))

    @property
    def rests(self) -> bool:
        """True while no step changes anything."""
        return self.lift is None or self.lift.rests

    def step(self, stamp: float, seconds: float) -> None:
        """Let ``seconds`` pass, until ``stamp``."""
        if self.lift is not None:
            self.lift.step(stamp, seconds)
