"""Return of memory that only a start needs to the system: pages of libraries, and free memory of the C library.

LLVM links the kernels when they are loaded, and is not needed for running them; much of other libraries only sets them
up. Their pages are those of files and never written to: one that is needed again is read anew, from the system's cache,
in some microseconds. Linux only; does nothing elsewhere.
"""

from __future__ import annotations

import ctypes
import mmap
import sys
from collections.abc import Iterator
from pathlib import Path

LIBRARY = ".so"  # in the names of such files
MAPS = Path("/proc/self/smaps")


def rest() -> int:
    """Return memory to the system; returns the bytes of libraries' pages. May be called while another thread loads."""
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
