"""Adding scans to the evidence grid. Needs the kernels."""

from __future__ import annotations

import numpy as np

from roboglot.autonomy.navigation.rules import GridFrame
from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.kernels.occupancy import FROZEN, SCANS, integrate, placed
from roboglot.model.components.mapping.annotations import Area
from roboglot.model.geometry import Pose


def paint(grid: EvidenceGrid, scan: ScanPoints, pose: Pose, *, fill: bool, maintained: tuple[Area, ...] = ()) -> None:
    """Add ``scan``, taken with base_link at ``pose`` in map; ``fill``: clear the floor between the rays too.

    With ``maintained`` areas, nothing changes outside them.
    """
    ends, min_x, max_x, min_y, max_y = placed(scan.ends, pose.x, pose.y, pose.yaw)
    grid.make_room(min(min_x, pose.x), min(min_y, pose.y), max(max_x, pose.x), max(max_y, pose.y))
    if grid.maintained != maintained:
        _freeze(grid, maintained)
    corner, grid.scans = grid.corner, grid.scans + 1
    ends -= (corner.x, corner.y)
    sensor = pose.compose(Pose(scan.sensor.x, scan.sensor.y))
    x, y = sensor.x - corner.x, sensor.y - corner.y
    grid.make_surfaces(len(ends))
    slots, surfaces, marks, number = grid.slots, grid.surfaces, grid.marks, 1 + grid.scans % SCANS
    grid.used = integrate(
        grid.evidence, slots, surfaces, grid.used, marks, number, ends, scan.hit, x, y, fill, RESOLUTION
    )


def _freeze(grid: EvidenceGrid, maintained: tuple[Area, ...]) -> None:
    """Let scans change cells inside the areas only; without areas, all cells."""
    frame = GridFrame(grid.corner, (grid.evidence.shape[0], grid.evidence.shape[1]))
    changing = np.full(frame.shape, not maintained)
    for area in maintained:
        changing |= frame.inside(area)
    grid.marks[changing & (grid.marks == FROZEN)] = 0
    grid.marks[~changing] = FROZEN
    grid.maintained = maintained
