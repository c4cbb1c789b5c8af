"""Things on a map that may be gone: they stand alone, on the map or among the cells that scans added to a loaded one.

Needs the kernels.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.kernels.occupancy import without_things
from roboglot.model.geometry import Point

THING_CELLS = 20  # largest single thing that may be a person or a robot
FREE = np.int16(-1)
GONE_NEAR = 0.1  # m around the former place of a removed leg in which the map no longer counts


def without_doubtful(grid: EvidenceGrid) -> NDArray[np.int16]:
    """Return a copy of the map's evidence with free cells in place of isolated things, which may go away.

    On a loaded map (``given``), cells that scans added are examined by themselves: a person mapped in a door is then
    isolated, although the wall is next to them.
    """
    shown: NDArray[np.int16] = without_things(grid.evidence, THING_CELLS)
    if grid.given is not None:
        added = np.where(grid.given, grid.evidence, FREE)
        shown[(added > 0) & (without_things(added, THING_CELLS) < 0)] = FREE
    return shown


def without_gone(evidence: NDArray[np.int16], corner: Point, gone: NDArray[np.float64]) -> NDArray[np.int16]:
    """Return a copy with free cells in place of obstacles around ``gone`` (n, 2; map, m)."""
    kept = evidence.copy()
    reach = math.ceil(GONE_NEAR / RESOLUTION)
    for x, y in ((gone - (corner.x, corner.y)) / RESOLUTION).tolist():
        row, column = math.floor(y), math.floor(x)
        part = kept[max(0, row - reach) : max(0, row + reach + 1), max(0, column - reach) : max(0, column + reach + 1)]
        part[part > 0] = -1
    return kept
