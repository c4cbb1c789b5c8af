"""A floor plan as polygons, for display. Knows no robot and no physics."""

from __future__ import annotations

import math
from collections.abc import Sequence

from roboglot.model.geometry import Point, Pose
from roboglot.model.stage import FloorPlan
from roboglot.simulation.building.blueprint import Solid, SolidKind, solids_of
from roboglot.simulation.world.description import WorldDescription

ROUND_CORNERS = 16  # of a cylinder's outline


def plan_of(world: WorldDescription, number: int) -> FloorPlan:
    """Return the plan of a world's floor as described, with the lift's door open."""
    floor = world.floors[number]
    walls: list[Sequence[Point]] = []
    furniture: list[Sequence[Point]] = []
    for solid in solids_of(floor, world.lift, lift_here=True):
        (walls if solid.kind is SolidKind.WALL else furniture).append(_outline(solid))
    return FloorPlan(number, floor.name, walls, furniture)


def _outline(solid: Solid) -> Sequence[Point]:
    """Return the footprint's corners, counter-clockwise (world, m)."""
    width, depth, _ = solid.size
    if solid.round:
        angles = [math.tau * corner / ROUND_CORNERS for corner in range(ROUND_CORNERS)]
        corners = [(width / 2 * math.cos(angle), width / 2 * math.sin(angle)) for angle in angles]
    else:
        corners = [(x * width / 2, y * depth / 2) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return [solid.pose.compose(Pose(x, y)).point for x, y in corners]
