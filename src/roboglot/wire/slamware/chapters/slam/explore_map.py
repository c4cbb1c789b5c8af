"""The explore map: a 36-byte header and one byte per cell (chapter "slam", maps/explore).

Little endian: x, y of the corner of cell (0, 0) as float32 (m), cells along x and along y as uint32, the cells' size as
float32 (m), 12 reserved bytes, the number of cells as uint32. Then the cells row by row, the row of the smallest
y first: 0 unknown, 1..127 free (127 most certain), 128..255 occupied (a negative int8, -127 most certain).
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.values import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = lazy("numpy")


HEADER = struct.Struct("<ffIIf12xI")
CELLS_MAX = 1 << 28  # 16384 x 16384


class BadMap(ValueError):
    """The bytes are not a valid map; the message says why."""


@dataclass(frozen=True, slots=True)
class ExploreMap:
    """Corner (x, y) and cell size in m; ``cells``: int8, shape (height, width), 0 unknown, > 0 free, < 0 occupied."""

    x: float
    y: float
    resolution: float
    cells: NDArray[np.int8]


def encode_explore_map(explored: ExploreMap) -> bytes:
    """Return the bytes of ``explored``."""
    height, width = explored.cells.shape
    header = HEADER.pack(explored.x, explored.y, width, height, explored.resolution, width * height)
    return header + explored.cells.tobytes()


def decode_explore_map(data: bytes) -> ExploreMap:
    """Return the map in ``data``. Raises BadMap."""
    if len(data) < HEADER.size:
        raise BadMap(f"{len(data)} bytes are too few for the header of {HEADER.size}")
    x, y, width, height, resolution, size = HEADER.unpack_from(data)
    if width * height != size or max(width, height, size) > CELLS_MAX:
        raise BadMap(f"{width} x {height} cells do not make {size}")
    if len(data) != HEADER.size + size:
        raise BadMap(f"{len(data) - HEADER.size} cells came, {size} were announced")
    if not (np.isfinite((x, y)).all() and 0 < resolution < np.inf):
        raise BadMap(f"no map has its corner at ({x}, {y}) and cells of {resolution} m")
    return ExploreMap(x, y, resolution, np.frombuffer(data, np.int8, size, HEADER.size).reshape(height, width))
