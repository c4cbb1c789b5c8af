"""Numeric kernels on plain arrays, compiled by Numba: grids, distances, search, scan matching. No model, no state.

Importing this package costs nothing; importing one of its modules imports Numba and loads the compiled code from the
cache on disk, or compiles it when there is none (some seconds each). ``python -m roboglot.kernels`` fills the cache.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator

MODULES = (
    "distance",
    "occupancy",
    "matching",
    "relocation",
    "placing",
    "graph",
    "search",
    "touring",
    "smoothing",
    "obstacles",
    "sweep",
    "raster",
    "raster_shading",
    "raster_rooms",
)


def load() -> Iterator[str]:
    """Import every kernel, compiling what is not cached; yields the name of each that is ready."""
    for name in MODULES:
        importlib.import_module(f"{__name__}.{name}")
        yield name
