"""The arrays behind the map: evidence and surfaces per cell, grown as needed. Knows no scan and no kernel.

Cells of 5 cm lie on multiples of 5 cm of the map frame. Array coordinates ("from the corner") are metres from the
corner of cell (0, 0) with the smallest x and y.
"""

from __future__ import annotations

import hashlib
import logging
import math
from collections.abc import Callable
from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.mapping.annotations import Area
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid

log = logging.getLogger(__name__)
T = TypeVar("T")

RESOLUTION = 0.05  # m
GRID_MAX = 8000  # cells along one side; anything beyond is not mapped
CELLS_MAX = 8_000_000  # 20,000 m2 at 8 bytes per cell and 20 per surface, twice while the map is straightened
GROWTH = 100  # cells of extra room when the grid grows
PER_STEP = 8  # evidence per step of the int8 map


class EvidenceGrid:
    """Map of the lidar's evidence by cells; see ``roboglot.kernels.occupancy`` for the arrays' meaning."""

    def __init__(self) -> None:
        self.evidence: NDArray[np.int16] = np.zeros((0, 0), np.int16)
        self.slots: NDArray[np.int32] = np.zeros((0, 0), np.int32)
        self.surfaces: NDArray[np.float32] = np.zeros((1, 5), np.float32)
        self.used = 1  # rows of the surfaces; no cell has the first one
        self.marks: NDArray[np.int16] = np.zeros((0, 0), np.int16)
        self.first_column = 0  # of column 0, counted from the map's origin
        self.first_row = 0
        self.scans = 0
        self.given: NDArray[np.bool_] | None = None  # free floor of the loaded map, if there is one
        self.maintained: tuple[Area, ...] | None = ()  # areas outside which marks protect cells from scans; (): none
        self.full = False  # whether something was omitted because of CELLS_MAX or GRID_MAX
        self._drawn = OccupancyGrid(np.zeros((0, 0), np.int8), RESOLUTION, Point())
        self._drawn_scans = 0
        self._kept: dict[str, tuple[int, object]] = {}

    @property
    def corner(self) -> Point:
        """Corner of cell (0, 0) in map, m."""
        return Point(self.first_column * RESOLUTION, self.first_row * RESOLUTION)

    def fingerprint(self) -> str:
        """Return a name that only equal grids at the same place have in common."""
        place = np.array((self.first_row, self.first_column, *self.evidence.shape), np.int64)
        return hashlib.blake2b(place.tobytes() + self.evidence.tobytes(), digest_size=8).hexdigest()

    def kept(self, name: str, made: Callable[[], T]) -> T:
        """Return the result of ``made``, cached until the map changes."""
        scans, value = self._kept.get(name, (-1, None))
        if scans != self.scans:
            value = made()
            self._kept[name] = (self.scans, value)
        return cast("T", value)

    def make_room(self, min_x: float, min_y: float, max_x: float, max_y: float) -> None:
        """Grow to contain the rectangle (map, m), up to CELLS_MAX cells, and GRID_MAX along a side."""
        row0, column0 = math.floor(min_y / RESOLUTION), math.floor(min_x / RESOLUTION)
        row1, column1 = math.floor(max_y / RESOLUTION) + 1, math.floor(max_x / RESOLUTION) + 1
        height, width = self.evidence.shape
        is_within = self.first_row <= row0 and row1 <= self.first_row + height
        if is_within and self.first_column <= column0 and column1 <= self.first_column + width:
            return
        empty = height == 0
        most = _side(row1 - row0 + 2 * GROWTH if empty else height)
        columns = _grown(self.first_column, self.first_column + width, column0, column1, empty, most)
        rows = _grown(self.first_row, self.first_row + height, row0, row1, empty, _side(columns[1] - columns[0]))
        if not self.full and not (_holds(rows, row0, row1) and _holds(columns, column0, column1)):
            self.full = True
            down, across = (n * RESOLUTION for n in (rows[1] - rows[0], columns[1] - columns[0]))
            log.warning("the map has its largest size, %.0f x %.0f m: scans beyond it are left out", across, down)
        if (rows, columns) == (
            (self.first_row, self.first_row + height),
            (self.first_column, self.first_column + width),
        ):
            return
        shape = (rows[1] - rows[0], columns[1] - columns[0])
        down, along = self.first_row - rows[0], self.first_column - columns[0]
        old = (slice(down, down + height), slice(along, along + width))
        evidence, slots, marks = np.zeros(shape, np.int16), np.zeros(shape, np.int32), np.zeros(shape, np.int16)
        if not empty:
            evidence[old], slots[old], marks[old] = self.evidence, self.slots, self.marks
        self.evidence, self.slots, self.marks = evidence, slots, marks
        self.maintained = self._still_maintained()
        self.first_row, self.first_column = rows[0], columns[0]
        if self.given is not None:
            given = np.zeros(shape, bool)
            given[old] = self.given
            self.given = given

    def make_surfaces(self, more: int) -> None:
        """Make room for the surfaces of ``more`` cells."""
        if self.used + more > len(self.surfaces):
            surfaces = np.zeros((self.used + more + self.used // 2, 5), np.float32)
            surfaces[: self.used] = self.surfaces[: self.used]
            self.surfaces = surfaces

    def seen_from(self, column: int, row: int) -> EvidenceGrid:
        """Return a view of this map with its origin at the corner of a cell, counted from the present origin."""
        moved = EvidenceGrid()
        moved.evidence, moved.slots, moved.marks = self.evidence, self.slots, self.marks
        moved.surfaces, moved.used = self.surfaces, self.used
        moved.first_column, moved.first_row = self.first_column - column, self.first_row - row
        moved.scans, moved.full, moved.given = self.scans, self.full, self.given
        moved.maintained = self._still_maintained()
        return moved

    def _still_maintained(self) -> tuple[Area, ...] | None:
        """Return the areas of ``maintained`` after the cells have moved; None: to be marked anew."""
        return () if self.maintained == () else None

    def copy(self) -> EvidenceGrid:
        """Return an independent copy."""
        copied = self.seen_from(0, 0)
        copied.evidence, copied.slots, copied.marks = self.evidence.copy(), self.slots.copy(), self.marks.copy()
        copied.surfaces, copied.maintained = self.surfaces.copy(), self.maintained
        return copied

    def empty_like(self) -> EvidenceGrid:
        """Return an empty map of the same size and place, for ``copy_rows``."""
        copied = self.seen_from(0, 0)
        copied.evidence, copied.marks = np.zeros_like(self.evidence), np.zeros_like(self.marks)
        copied.slots = np.zeros_like(self.slots)
        copied.surfaces = self.surfaces.copy()  # few: rows of cells have theirs once they are copied
        return copied

    def copy_rows(self, other: EvidenceGrid, rows: slice) -> None:
        """Copy rows from ``other``, which has the same size."""
        for mine, its in ((self.evidence, other.evidence), (self.slots, other.slots), (self.marks, other.marks)):
            mine[rows] = its[rows]

    def occupancy(self) -> OccupancyGrid:
        """Return the model's form of the map, trimmed to known cells; read only."""
        if self._drawn_scans != self.scans:
            rows, columns = (np.flatnonzero(self.evidence.any(axis=axis)) for axis in (1, 0))
            known = self.evidence[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] if len(rows) else self.evidence
            steps = np.abs(known) // PER_STEP + (known != 0)  # known cells never become 0
            drawn = (np.sign(known) * np.minimum(steps, 127)).astype(np.int8)
            drawn.setflags(write=False)
            first = (int(columns[0]), int(rows[0])) if len(rows) else (0, 0)
            origin = Point((self.first_column + first[0]) * RESOLUTION, (self.first_row + first[1]) * RESOLUTION)
            self._drawn, self._drawn_scans = OccupancyGrid(drawn, RESOLUTION, origin), self.scans
        return self._drawn


def _holds(interval: tuple[int, int], begin: int, end: int) -> bool:
    return interval[0] <= begin and end <= interval[1]


def is_too_large(height: int, width: int) -> bool:
    """Return whether a map of this size has too many cells."""
    return max(height, width) > GRID_MAX or height * width > CELLS_MAX


def _side(other: int) -> int:
    """Return the most cells for one side, given the ``other``."""
    return min(GRID_MAX, CELLS_MAX // max(1, other))


def _grown(begin: int, end: int, wanted_begin: int, wanted_end: int, empty: bool, most: int) -> tuple[int, int]:
    """Return the interval [begin, end) grown to contain the wanted one, with room to spare, up to ``most`` cells."""
    if empty:
        begin = end = (wanted_begin + wanted_end) // 2
    elif begin <= wanted_begin and wanted_end <= end:
        return begin, end
    new_begin = wanted_begin - GROWTH if empty or wanted_begin < begin else begin
    new_end = wanted_end + GROWTH if empty or wanted_end > end else end
    if new_end - new_begin > most:  # keep the present extent and share the rest
        spare = most - (end - begin)
        before = min(begin - new_begin, max(spare // 2, spare - (new_end - end)))
        new_begin = begin - before
        new_end = min(new_end, new_begin + most)
    return new_begin, new_end
