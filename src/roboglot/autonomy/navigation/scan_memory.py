"""Memory, cell by cell, of obstacles that the lidar saw and the map does not show. Needs the kernels."""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.kernels.obstacles import remember
from roboglot.model.geometry import Pose

OBSTACLE_RANGE = 5.0  # m within which obstacles are remembered
NOTED_MAX = 4000  # cells in the list; with more, the whole map is searched

Scalar = TypeVar("Scalar", bound=np.generic)


class Cells(Generic[Scalar]):
    """A number for each cell of a map, 0 at first; grows with the map, and starts again with another one.

    Pages that hold only zeros are never written, so the system need not provide them.
    """

    def __init__(self, kind: type[Scalar]) -> None:
        self._kind = kind
        self._grid: EvidenceGrid | None = None
        self._first = (0, 0)
        self._cells: NDArray[Scalar] = np.zeros((0, 0), kind)

    def of(self, grid: EvidenceGrid) -> NDArray[Scalar]:
        """Return the numbers, which may be written to; a map that has grown, or another one, has another array."""
        first, shape, kept = (grid.first_row, grid.first_column), grid.evidence.shape, self._cells
        if grid is self._grid and first == self._first and shape == kept.shape:
            return kept
        cells = np.zeros(shape, self._kind)
        if grid is self._grid:
            rows, columns = np.nonzero(kept)
            cells[rows + self._first[0] - first[0], columns + self._first[1] - first[1]] = kept[rows, columns]
        self._grid, self._first, self._cells = grid, first, cells
        return cells


class Sightings:
    """Times (s) of the last sighting in a map's cells (0: never), with a list of the cells that are not 0.

    ``noted``: (row, column) of the first ``count`` such cells; a negative count: too many for the list.
    """

    def __init__(self) -> None:
        self._seen = Cells(np.float32)
        self._listed: NDArray[np.float32] | None = None
        self.noted, self.count = np.empty((NOTED_MAX, 2), np.int32), 0

    def of(self, grid: EvidenceGrid) -> NDArray[np.float32]:
        """Return the times, which may be written to; cells that become more than 0 must be noted."""
        seen = self._seen.of(grid)
        if seen is not self._listed:
            cells = np.argwhere(seen)
            self._listed, self.count = seen, len(cells) if len(cells) <= NOTED_MAX else -1
            self.noted[: max(0, self.count)] = cells[: max(0, self.count)]
        return seen


class ScanMemory:
    """Memory of scans on one map at a time."""

    def __init__(self) -> None:
        self._sightings = Sightings()

    def seen(self, grid: EvidenceGrid) -> NDArray[np.float32]:
        """Return the time (s) of the last sighting in each of the map's cells; 0: never, or rays have passed since."""
        return self._sightings.of(grid)

    def observe(
        self, grid: EvidenceGrid, shown: NDArray[np.int16], scan: ScanPoints, pose: Pose, now: float
    ) -> NDArray[np.float64]:
        """Remember obstacles of ``scan`` that are not ``shown`` on the map; return its near echoes in map (n, 2; m)."""
        corner, sightings, stamp = grid.corner, self._sightings, max(now, 1e-3)
        at = np.array((pose.x - corner.x, pose.y - corner.y, pose.yaw, corner.x, corner.y))
        seen = sightings.of(grid)
        sightings.count, echoes = remember(
            shown, seen, scan.ends, scan.hit, at, OBSTACLE_RANGE, stamp, RESOLUTION, sightings.noted, sightings.count
        )
        return echoes
