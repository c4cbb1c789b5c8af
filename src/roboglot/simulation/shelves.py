"""Shelves that robots lift with their jacks and carry about. A carried shelf passes through what is in its way."""

from __future__ import annotations

import math

from roboglot.model.geometry import Pose
from roboglot.simulation.blueprint import shelf_solids
from roboglot.simulation.description import Shelf
from roboglot.simulation.props import Props


class ShelfStand:
    """One shelf: where it stands, or how it is carried."""

    def __init__(self, shelf: Shelf, floor: int, key: str, props: Props) -> None:
        self.shelf, self.floor, self._key, self._props = shelf, floor, key, props
        self.pose = shelf_pose(shelf)
        self.lifted = 0.0  # m above the floor
        self._show()

    def covers(self, pose: Pose, floor: int) -> bool:
        """Whether something at ``pose`` (world) stands well under its board."""
        seen = pose.relative_to(self.pose)
        width, depth = self.shelf.size
        return floor == self.floor and abs(seen.x) <= width / 4 and abs(seen.y) <= depth / 4

    def move(self, pose: Pose, floor: int, lifted: float) -> None:
        """Have it there, so high above the floor (m)."""
        self.pose, self.floor, self.lifted = pose, floor, lifted
        self._show()

    def _show(self) -> None:
        for index, solid in enumerate(shelf_solids(self.shelf, self.pose, self.lifted)):
            self._props.put(f"{self._key} {index}", self.floor, solid)


def shelf_pose(shelf: Shelf) -> Pose:
    """Where the description has its middle."""
    return Pose(*shelf.at, math.radians(shelf.facing))
