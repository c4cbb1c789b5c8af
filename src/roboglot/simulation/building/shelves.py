"""Shelves that robots lift and carry with their jacks, and their collisions."""

from __future__ import annotations

import math
from collections.abc import Hashable

from roboglot.model.geometry import Pose
from roboglot.simulation.building.blueprint import Solid, SolidKind, shelf_solids, solids_of
from roboglot.simulation.building.overlap import overlap, reach_of
from roboglot.simulation.building.props import Props
from roboglot.simulation.world.description import Shelf, WorldDescription


class ShelfStand:
    """One shelf, standing or carried."""

    def __init__(self, shelf: Shelf, floor: int, key: str, props: Props, world: WorldDescription) -> None:
        self.shelf, self.floor, self._key, self._props, self._world = shelf, floor, key, props, world
        self._fixed: dict[int, list[Solid]] = {}  # by floor: immovable solids
        self.pose = shelf_pose(shelf)
        self.lifted = 0.0  # m above the floor
        self._show()

    def covers(self, pose: Pose, floor: int) -> bool:
        """True if ``pose`` (world) is well under the board."""
        seen = pose.relative_to(self.pose)
        width, depth = self.shelf.size
        return floor == self.floor and abs(seen.x) <= width / 4 and abs(seen.y) <= depth / 4

    def meets(self, pose: Pose, floor: int, lifted: float) -> frozenset[Hashable]:
        """Return the names of all solids that the shelf would overlap there: walls, furniture, other shelves."""
        parts = list(shelf_solids(self.shelf, pose, lifted))
        if floor not in self._fixed:
            solids = solids_of(self._world.floors[floor], self._world.lift, lift_here=True)
            self._fixed[floor] = [solid for solid in solids if solid.kind is not SolidKind.DOCK]  # docks can be moved
        around: list[tuple[Hashable, Solid]] = list(enumerate(self._fixed[floor]))
        around += [
            (key, solid)
            for key, (number, solid) in self._props.solids.items()
            if number == floor and not key.startswith(f"{self._key} ")
        ]
        reach = math.hypot(*self.shelf.size) / 2
        near = [(name, solid) for name, solid in around if solid.pose.distance_to(pose) < reach + reach_of(solid)]
        return frozenset(name for name, solid in near if any(overlap(solid, part) for part in parts))

    def move(self, pose: Pose, floor: int, lifted: float) -> None:
        """Move the shelf to ``pose`` (world), ``lifted`` m above the floor."""
        self.pose, self.floor, self.lifted = pose, floor, lifted
        self._show()

    def _show(self) -> None:
        for index, solid in enumerate(shelf_solids(self.shelf, self.pose, self.lifted)):
            self._props.put(f"{self._key} {index}", self.floor, solid)


def shelf_pose(shelf: Shelf) -> Pose:
    """Return the described pose of a shelf's middle (world)."""
    return Pose(*shelf.at, math.radians(shelf.facing))
