"""The shape of uneven floors: heights, grip, convex pieces for the physics, slices for the lidar.

Pure geometry, in each floor's own frame (z from the floor's surface). Knows no robot and no simulator.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from roboglot.model.geometry import Pose
from roboglot.simulation.world.description import Terrain, WorldDescription

BELOW = 0.05  # m by which pieces extend into the floor, so that there is no sharp edge
FLAT = 1e-4  # m; lower pieces only change the friction

Corner = tuple[float, float, float]


class Ground:
    """Height and grip of the ground under wheels, by floor."""

    def __init__(self, world: WorldDescription) -> None:
        self._terrain = [floor.relief for floor in world.floors]
        self.uneven = any(self._terrain)

    def height(self, x: float, y: float, floor: int) -> float:
        """Return the height of the surface above the floor's level, m."""
        return max((_height(terrain, x, y) for terrain in self._terrain[floor]), default=0.0)

    def grip(self, x: float, y: float, floor: int) -> float:
        """Return the grip relative to a dry floor's; for overlapping terrain, the last one's."""
        on = [terrain.grip for terrain in self._terrain[floor] if _way(terrain, x, y) is not None]
        return on[-1] if on else 1.0


def pieces_of(terrain: Terrain) -> Iterator[Sequence[Corner]]:
    """Yield convex pieces as lists of their corners (m)."""
    frame, half = Pose(*terrain.at, math.radians(terrain.facing)), terrain.width / 2
    for (a, low), (b, high) in zip(terrain.profile, terrain.profile[1:], strict=False):
        if max(low, high) < FLAT:
            continue
        corners = []
        for way, top in ((a, low), (b, high)):
            for side in (-half, half):
                at = frame.compose(Pose(way, side))
                corners += [(at.x, at.y, -BELOW), (at.x, at.y, top)]
        yield corners


def slices_of(terrain: Terrain, height: float) -> Iterator[tuple[Pose, float, float]]:
    """Yield the rectangles of a terrain above a level plane at ``height``: middle, length along x, width (m)."""
    frame = Pose(*terrain.at, math.radians(terrain.facing))
    for (a, low), (b, high) in zip(terrain.profile, terrain.profile[1:], strict=False):
        if height >= max(low, high):
            continue
        if height > min(low, high):
            crossing = a + (b - a) * (height - low) / (high - low)
            a, b = (crossing, b) if high > low else (a, crossing)
        yield frame.compose(Pose((a + b) / 2)), b - a, terrain.width


def _way(terrain: Terrain, x: float, y: float) -> float | None:
    """Return a point's distance along the profile, m; None beside it."""
    seen = Pose(x, y).relative_to(Pose(*terrain.at, math.radians(terrain.facing)))
    inside = abs(seen.y) <= terrain.width / 2 and terrain.profile[0][0] <= seen.x <= terrain.profile[-1][0]
    return seen.x if inside else None


def _height(terrain: Terrain, x: float, y: float) -> float:
    way = _way(terrain, x, y)
    if way is None:
        return 0.0
    for (a, low), (b, high) in zip(terrain.profile, terrain.profile[1:], strict=False):
        if way <= b:
            return low + (high - low) * max(0.0, way - a) / (b - a)
    return terrain.profile[-1][1]
