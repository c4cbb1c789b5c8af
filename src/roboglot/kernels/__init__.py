"""Numeric kernels on plain arrays, compiled by Numba: grids, distances, search, scan matching. No model, no state.

Importing this package costs nothing; importing one of its modules imports Numba and loads the compiled code from the
cache on disk, or compiles it when there is none (some seconds each). ``python -m roboglot.kernels`` fills the cache.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import get_ident

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
WORLD = ("sweep", "rays", "batch", "free_motion", "ticks")
CAMERA = ("raster", "raster_shading", "posing")
MODULES = (*NAVIGATION, *CAMERA[:2], *WORLD, *CAMERA[2:])

LIBRARY = ".so"  # in the names of such files
MAPS = Path("/proc/self/smaps")


@contextmanager
def loading() -> Iterator[None]:
    """Context for imports of kernels; afterwards returns the memory that only loading needs (100 MB) to the system.

    Costs nothing if all kernels were loaded before.
    """
    before = _loaded()
    with _without_yaml():
        yield
    if _loaded() != before:
        rest()


@contextmanager
def _without_yaml() -> Iterator[None]:
    """Context in which this thread cannot import ``yaml``, which Numba loads only to read ``.numba_config.yaml``.

    Without that file, this saves 1 MB in each process. Other threads may import it meanwhile, so ``sys.modules`` cannot
    block it.
    """
    thread = get_ident()

    class Finder:
        @staticmethod
        def find_spec(name: str, _path: object, _target: object = None) -> None:
            if name == "yaml" and get_ident() == thread and not Path(".numba_config.yaml").exists():
                raise ModuleNotFoundError(f"{name} is not needed", name=name)

    sys.meta_path.insert(0, Finder)
    try:
        yield
    finally:
        sys.meta_path.remove(Finder)


def _loaded() -> set[str]:
    return {module for module in MODULES if f"{__name__}.{module}" in sys.modules}


def rest() -> int:
    """Release memory that only a start needs; return how many bytes of it were pages of libraries.

    LLVM links kernels when they are loaded, and is not needed to run them; other libraries have much set-up code, too.
    Their pages are backed by files and were never written: one that is needed again is read from the system's cache in
    some microseconds. Does nothing outside Linux. Other threads may load modules meanwhile.
    """
    import ctypes
    import mmap

    if sys.platform != "linux" or not MAPS.exists():
        return 0
    libc = ctypes.CDLL(None, use_errno=True)
    given = 0
    for start, end, resident in _unwritten(MAPS.read_text()):
        if libc.madvise(ctypes.c_void_p(start), ctypes.c_size_t(end - start), mmap.MADV_DONTNEED) == 0:
            given += resident
    if hasattr(libc, "malloc_trim"):  # glibc's
        libc.malloc_trim(0)
    return given


def _unwritten(maps: str) -> Iterator[tuple[int, int, int]]:
    """Return start, end and resident bytes of libraries' mappings that are read-only and were never written."""
    region: tuple[int, int] | None = None
    facts: dict[str, int] = {}
    for line in maps.splitlines():
        name, _, value = line.partition(":")
        if value.endswith("kB"):
            facts[name] = int(value.split()[0]) * 1024
        elif name == "VmFlags":
            if region and facts.get("Rss") and not (facts.get("Private_Dirty", 1) or facts.get("Anonymous", 1)):
                yield *region, facts["Rss"]
            region = None
        elif not line.split()[0].endswith(":"):  # other lines contain no size in kilobytes
            span, rights, *_ = line.split()
            ours = LIBRARY in line.rpartition("/")[2] and "w" not in rights
            low, _, high = span.partition("-")
            region, facts = (int(low, 16), int(high, 16)) if ours else None, {}
