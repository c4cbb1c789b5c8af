"""Where robots start: as told, at the world's start, on docks (facing away from them), or beside the first one."""

from __future__ import annotations

import math
from collections.abc import Sequence

from roboglot.model.geometry import Pose
from roboglot.simulation.description import WorldDescription

CONTACT_GAP = 0.005  # m between hull and dock at the start
BESIDE = 0.3  # m between robots that start side by side


def docks_of(world: WorldDescription) -> list[list[Pose]]:
    """Per floor, the docks' fronts, +x away from the dock."""
    return [[dock.pose for dock in floor.docks] for floor in world.floors]


def starting_places(
    world: WorldDescription, wanted: Sequence[tuple[Pose | None, int]], radii: Sequence[float]
) -> list[tuple[Pose, int]]:
    """Pose and floor of every robot, in order. Raises ValueError for a floor that does not exist."""
    free_docks = [(pose, number) for number, docks in enumerate(docks_of(world)) for pose in docks]
    places: list[tuple[Pose, int]] = []
    start = world.start
    for (pose, floor), radius in zip(wanted, radii, strict=True):
        if not 0 <= floor < len(world.floors):
            raise ValueError(f"there is no floor {floor}; the world has {len(world.floors)}")
        if pose is not None:
            places.append((pose, floor))
        elif start is not None:
            places.append((Pose(*start.at, math.radians(start.facing)), start.floor))
            start = None
        elif own := next((dock for dock in free_docks if dock[1] == floor), None):
            free_docks.remove(own)
            places.append((own[0].compose(Pose(radius + CONTACT_GAP)), floor))
        elif places:
            last, last_floor = places[-1]
            places.append((last.compose(Pose(0.3 if len(places) == 1 else 0.0, -(2 * radius + BESIDE))), last_floor))
        else:
            middle = world.floors[floor]
            x, y = (o + s / 2 for o, s in zip(middle.origin, middle.size, strict=True))
            places.append((Pose(x, y), floor))
    return places
