"""Occupancy of the robot's place by its map: a wall, a virtual wall, a forbidden area."""

from __future__ import annotations

import itertools

from roboglot.model.components.mapping.annotations import AreaKind, LineKind, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot

SHARE = 0.5  # of the hull's radius around its centre that must be free
CERTAIN = 40  # evidence from which a cell counts as occupied


def stands_in_something(robot: Robot) -> bool:
    """Return whether the place of a robot about to drive is occupied."""
    if Localization not in robot or Mapping not in robot:
        return False
    here, reach = robot[Localization].pose, robot.description.radius * SHARE
    window = robot[Mapping].grid.window(here.x - reach, here.y - reach, here.x + reach, here.y + reach)
    if bool((window.log_odds >= CERTAIN).any()):
        return True
    return MapAnnotations in robot and _drawn_over(robot, here, reach)


def _drawn_over(robot: Robot, here: Pose, reach: float) -> bool:
    drawn = robot[MapAnnotations].current
    if any(area.contains(here) for area in drawn.areas_of(AreaKind.FORBIDDEN)):
        return True
    for line in drawn.lines_of(LineKind.WALL):
        points = line.points()
        for start, end in itertools.pairwise(points):
            along = end.x - start.x, end.y - start.y
            length = along[0] ** 2 + along[1] ** 2
            share = ((here.x - start.x) * along[0] + (here.y - start.y) * along[1]) / length if length else 0.0
            share = min(max(share, 0.0), 1.0)
            gap = Pose(start.x + share * along[0], start.y + share * along[1])
            if gap.distance_to(here) < reach:
                return True
    return False
