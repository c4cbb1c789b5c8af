"""Adding scans to the evidence grid. Needs the kernels."""

from __future__ import annotations

from roboglot.autonomy.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.scan_points import ScanPoints
from roboglot.kernels.occupancy import integrate
from roboglot.model.geometry import Pose


def paint(grid: EvidenceGrid, scan: ScanPoints, pose: Pose, *, fill: bool) -> None:
    """Add ``scan``, taken with base_link at ``pose`` in map; ``fill``: clear the floor between the rays too."""
    ends = scan.in_frame(pose, scan.ends)
    (min_x, min_y), (max_x, max_y) = ends.min(axis=0).tolist(), ends.max(axis=0).tolist()
    grid.make_room(min(min_x, pose.x), min(min_y, pose.y), max(max_x, pose.x), max(max_y, pose.y))
    corner, grid.scans = grid.corner, grid.scans + 1
    ends -= (corner.x, corner.y)
    sensor = pose.compose(Pose(scan.sensor.x, scan.sensor.y))
    x, y = sensor.x - corner.x, sensor.y - corner.y
    integrate(grid.evidence, grid.surface, grid.marks, grid.scans, ends, scan.hit, x, y, fill, RESOLUTION)
