"""Settings of the process, made before the event loop starts, its guaranteed end, and the end of others."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8  # from malloc.h
SWITCH_SECONDS = 0.001  # s for which other threads (database, pictures) may block the main thread
KEPT, SPARE = 1 << 19, 1 << 21  # bytes of blocks that come from the heap, and of free heap that is not given back
STDERR = 2
LAST_SECONDS = 10.0  # s after a signal; closing takes one or two


def prepare() -> None:
    """Set up heap, threads and gRPC's log for a process that serves robots; before NumPy is imported."""
    _give_memory_back()
    sys.setswitchinterval(SWITCH_SECONDS)
    os.environ.setdefault("GRPC_VERBOSITY", "NONE")  # the door logs the errors that matter
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # our matrices are small, and its threads wait without sleeping


def end_in_any_case() -> None:
    """End the process after ``LAST_SECONDS`` s even if a thread or task hangs."""
    timer = threading.Timer(LAST_SECONDS, _cut_short)
    timer.daemon = True
    timer.start()


def has_ended(pid: int) -> bool:
    """Return True for a process that has ended, also if its parent does not know yet; and for 0."""
    try:
        return not pid or Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return True


class Running(NamedTuple):
    """A process; ``has_ended``: its parent does not know yet."""

    pid: int
    parent: int
    name: str
    has_ended: bool


def running() -> Iterator[Running]:
    """Yield every process of this machine; none where the system has no ``/proc``."""
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has just ended
            name, _, rest = stat.read_text("utf-8", "replace").partition("(")[2].rpartition(")")
            state, parent, *_ = rest.split()
            yield Running(int(stat.parent.name), int(parent), name, state in "ZX")


def _cut_short() -> None:
    with contextlib.suppress(OSError):
        os.write(STDERR, f"roboglot: still closing after {LAST_SECONDS:g} s, so it ends now\n".encode())
    os._exit(1)


def _give_memory_back() -> None:
    """Set glibc to keep one heap and return large blocks at once, which saves 30 MB as maps come and go.

    Scan matching allocates and frees blocks of 400 kB: taken from the kernel each time, page by page, they would cost a
    quarter of a turning robot's processor time.
    """
    with contextlib.suppress(OSError, AttributeError):  # other C libraries lack these options
        mallopt = ctypes.CDLL(None).mallopt
        for parameter, value in ((M_ARENA_MAX, 1), (M_MMAP_THRESHOLD, KEPT), (M_TRIM_THRESHOLD, SPARE)):
            mallopt(parameter, value)
