"""Numeric kernels on plain arrays, compiled by Numba: grids, distances, search, scan matching. No model, no state.

Importing this package costs nothing; importing one of its modules imports Numba and loads the compiled code from the
cache on disk, or compiles it when there is none (some seconds each). ``python -m roboglot.kernels`` fills the cache.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

# The order: needed by mapping and navigation, imported by others, slow to compile.
NAVIGATION = (
    "linear",
    "distance",
    "graph",
    "obstacles",
    "depth",
    "matching",
    "occupancy",
    "touring",
    "placing",
    "search",
)
MODULES = (*NAVIGATION, "raster", "raster_shading", "sweep", "rays", "together", "gliding", "posing")


@contextmanager
def loading() -> Iterator[None]:
    """Context for imports of kernels: returns the memory that only loading needs (100 MB) to the system afterwards.

    Costs nothing if everything was there already.
    """
    before = _loaded()
    yield
    if _loaded() != before:
        from roboglot.kernels.rest import rest

        rest()


def _loaded() -> set[str]:
    return {module for module in MODULES if f"{__name__}.{module}" in sys.modules}
