"""Memory, cell by cell, of obstacles outside the lidar's plane, whose removal no scan can show.

Needs the kernels.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.low_sight import LowView
from roboglot.autonomy.navigation.rules import GridFrame
from roboglot.autonomy.navigation.scan_memory import Cells, Sightings
from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.kernels.depth import remember_low, seen_since
from roboglot.model.geometry import Pose

KEPT = 60.0  # s after which a sighting is forgotten
SPARE = 0.1  # s: cells round their time
EXPLAINED = 0.1  # m around an echo within which depth adds nothing

Points = NDArray[np.float64]


class LowMemory:
    """Memory of low obstacles on one map at a time."""

    def __init__(self) -> None:
        self._sightings = Sightings()
        self._heights = Cells(np.float32)  # lowest of the last sighting in each cell, m
        self._latest = -math.inf  # s: time of the last sighting of all

    def observe(self, grid: EvidenceGrid, view: LowView, echoes: Points, pose: Pose, now: float) -> Points:
        """Note obstacles that neither the map nor ``echoes`` (map) show; return them in map (n, 2; m).

        Obstacles are forgotten where the view shows floor, and as high above it as they were seen.
        """
        if not len(view.obstacles) and self._latest < now - KEPT:
            return np.empty((0, 2))  # nothing to note, and nothing that floor would clear
        corner, sightings, stamp = grid.corner, self._sightings, max(now, 1e-3)
        seen, at = sightings.of(grid), np.array((pose.x, pose.y, pose.yaw))
        first, noted = np.array((corner.x, corner.y)), (sightings.noted, sightings.count)
        heights = self._heights.of(grid)
        found: Points
        sightings.count, found = remember_low(
            grid.evidence,
            seen,
            heights,
            view.floor,
            view.obstacles,
            echoes,
            at,
            first,
            stamp,
            EXPLAINED,
            RESOLUTION,
            *noted,
        )
        if len(found):
            self._latest = stamp
        return found

    def kept(self, grid: EvidenceGrid) -> list[NDArray[np.float32]]:
        """Return ``seen`` in a list, which is empty before the first sighting."""
        return [self.seen(grid)] if self._latest > -math.inf else []

    def seen(self, grid: EvidenceGrid) -> NDArray[np.float32]:
        """Return the time (s) of the last sighting in each of the map's cells; 0: never."""
        return self._sightings.of(grid)

    def around(self, grid: EvidenceGrid, pose: Pose, reach: float, since: float) -> Points:
        """Return the middles (map, m; n, 2) of cells within ``reach`` m with an obstacle seen ``since`` (s) or later.

        Obstacles beside the robot need this memory, as most of these sensors have a small view.
        """
        if self._latest < since - SPARE:
            return np.empty((0, 2))  # most robots see nothing low for most of the time
        corner, seen, sightings = grid.corner, self._sightings.of(grid), self._sightings
        rows, columns = GridFrame(corner, grid.evidence.shape).around((pose.point,), reach)
        window = np.array((rows.start, rows.stop, columns.start, columns.stop))
        listed = sightings.noted, sightings.count
        found: Points = seen_since(seen, *listed, window, max(since, 1e-3), corner.x, corner.y, RESOLUTION)
        return found
