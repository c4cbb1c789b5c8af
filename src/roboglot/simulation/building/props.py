"""Movable boxes of the world: docks, landing doors, shelves, obstacles, people in the lift.

Each is a mocap body in the physics under its key, and a solid on a floor for sensors. Knows no meaning.
"""

from __future__ import annotations

import math
from collections import defaultdict
from typing import TYPE_CHECKING

from roboglot.model.errors import NotFound
from roboglot.simulation.building.blueprint import Solid
from roboglot.simulation.building.cards import PrintedTag
from roboglot.simulation.world.description import WorldDescription

if TYPE_CHECKING:
    from mujoco import MjData, MjModel

OBSTACLES_MAX = 16
PASSENGERS_MAX = 4
TAGS_MAX = 16  # added through the stage
SHELF_PARTS = 5  # four legs and a board
AWAY = (0.0, 0.0, -50.0)  # where absent props wait


class Props:
    """The movable boxes by key. ``solids``: the present ones, with floor and box, z from the floor's surface."""

    def __init__(self, model: MjModel, data: MjData, elevations: list[float]) -> None:
        self._model, self._data, self._elevations = model, data, elevations
        self.solids: dict[str, tuple[int, Solid]] = {}
        self.revisions: dict[int, int] = defaultdict(int)  # number of changes per floor
        self.tags: dict[int, tuple[int, PrintedTag]] = {}
        """Printed codes that were hung up, by number: floor and code; nothing collides with them."""

    def put(self, key: str, floor: int, solid: Solid) -> None:
        """Place a box, or move it."""
        before = self.solids.get(key)
        if before == (floor, solid):
            return
        if before is None:
            self._collide(key, True)
        if before is None or before[1].size != solid.size:
            self._resize(key, solid.size)
        self.solids[key] = floor, solid
        self._touched(floor, before)
        mocap, pose = self._model.body(key).mocapid[0], solid.pose
        self._data.mocap_pos[mocap] = (pose.x, pose.y, self._elevations[floor] + solid.base + solid.size[2] / 2)
        self._data.mocap_quat[mocap] = (math.cos(pose.yaw / 2), 0.0, 0.0, math.sin(pose.yaw / 2))

    def remove(self, key: str) -> None:
        """Remove a box; do nothing if it is absent."""
        if (before := self.solids.pop(key, None)) is not None:
            self._touched(before[0], None)
            self._collide(key, False)
            self._data.mocap_pos[self._model.body(key).mocapid[0]] = AWAY

    def hang(self, tag: PrintedTag, floor: int) -> int:
        """Hang up a printed code; return its number. Raises ValueError for too many."""
        number = next((n for n in range(TAGS_MAX) if n not in self.tags), None)
        if number is None:
            raise ValueError(f"at most {TAGS_MAX} tags can be added to a world")
        self.tags[number] = floor, tag
        return number

    def take_down(self, number: int) -> None:
        """Remove a printed code. Raises NotFound."""
        if self.tags.pop(number, None) is None:
            raise NotFound(f"there is no added tag {number}")

    def elevation(self, floor: int) -> float:
        """Return the elevation of a floor's surface, m."""
        return self._elevations[floor]

    def on(self, floor: int) -> list[Solid]:
        """Return the props on a floor."""
        return [solid for number, solid in self.solids.values() if number == floor]

    def _touched(self, floor: int, before: tuple[int, Solid] | None) -> None:
        self.revisions[floor] += 1
        if before is not None and before[0] != floor:
            self.revisions[before[0]] += 1

    def _collide(self, key: str, there: bool) -> None:
        """Switch the check for contacts between robots and a box."""
        model, body = self._model, self._model.body(key)
        model.body_conaffinity[body.id] = model.geom_conaffinity[body.geomadr[0]] if there else 0

    def _resize(self, key: str, size: tuple[float, float, float]) -> None:
        """Set a box's size, also in the bounds that rule out collisions and rays early."""
        model, half = self._model, [extent / 2 for extent in size]
        geom, body = model.geom(key).id, model.body(key).id
        model.geom_size[geom] = half
        model.geom_rbound[geom] = math.hypot(*half)
        model.geom_aabb[geom] = model.bvh_aabb[model.body_bvhadr[body]] = [0, 0, 0, *half]


def keys_of(world: WorldDescription) -> list[str]:
    """Return the keys of all movable boxes that a world may have."""
    keys = [f"obstacle {index}" for index in range(OBSTACLES_MAX)]
    for number, floor in enumerate(world.floors):
        keys += [f"dock {number} {index}" for index in range(len(floor.docks))]
        keys += [f"shelf {number} {index} {part}" for index in range(len(floor.shelves)) for part in range(SHELF_PARTS)]
        if world.lift is not None:
            keys += [f"landing door {number} {half}" for half in range(2)]
    if world.lift is not None:
        keys += [f"passenger {index}" for index in range(PASSENGERS_MAX)]
    return keys
