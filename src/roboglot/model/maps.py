"""Maps and their points of interest, in the map frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.model.geometry import Point, Pose
from roboglot.values import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = lazy("numpy")


@dataclass(frozen=True, slots=True)
class OccupancyGrid:
    """Evidence per cell.

    ``log_odds`` (height, width) int8: 0 unknown, below 0 free (-127 most certain), above 0 occupied (127 most certain).
    Row 0 has the smallest y; ``origin`` is the corner of cell (0, 0) with the smallest x and y; ``resolution`` is in m.
    """

    log_odds: NDArray[np.int8]
    resolution: float
    origin: Point

    @property
    def width(self) -> int:
        """Cells along x."""
        return int(self.log_odds.shape[1])

    @property
    def height(self) -> int:
        """Cells along y."""
        return int(self.log_odds.shape[0])

    def cell_of(self, point: Point | Pose) -> tuple[int, int]:
        """(row, column) of the cell that holds ``point``; may lie outside."""
        return (
            int(np.floor((point.y - self.origin.y) / self.resolution)),
            int(np.floor((point.x - self.origin.x) / self.resolution)),
        )

    def window(self, min_x: float, min_y: float, max_x: float, max_y: float) -> OccupancyGrid:
        """Return the part that overlaps the rectangle, on the same cell borders; empty where nothing does."""
        row0, col0 = self.cell_of(Point(min_x, min_y))
        row1, col1 = (
            int(np.ceil((v - o) / self.resolution)) for v, o in ((max_y, self.origin.y), (max_x, self.origin.x))
        )
        row0, row1 = (min(max(r, 0), self.height) for r in (row0, row1))
        col0, col1 = (min(max(c, 0), self.width) for c in (col0, col1))
        origin = Point(self.origin.x + col0 * self.resolution, self.origin.y + row0 * self.resolution)
        return OccupancyGrid(self.log_odds[row0 : max(row0, row1), col0 : max(col0, col1)], self.resolution, origin)

    def trimmed(self) -> OccupancyGrid:
        """Return the smallest window that holds every known cell; empty if none is known."""
        rows = cols = np.empty(0, np.intp)
        if self.log_odds.size:  # a map of 0 by 10^10 cells is small, and its rows' masks are not
            rows, cols = (np.flatnonzero(self.log_odds.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return OccupancyGrid(self.log_odds[:0, :0], self.resolution, self.origin)
        origin = Point(self.origin.x + int(cols[0]) * self.resolution, self.origin.y + int(rows[0]) * self.resolution)
        return OccupancyGrid(self.log_odds[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1], self.resolution, origin)


@dataclass(frozen=True, slots=True)
class PointOfInterest:
    """A named place: ``metadata`` is free text by key, kept as it came."""

    id: str
    pose: Pose
    metadata: Mapping[str, str] = field(default_factory=dict)
