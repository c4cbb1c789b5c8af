"""Resource use of a process, as counted by the kernel. Blocks for some microseconds per process."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from roboglot.values import dataclass

_PAGE = os.sysconf("SC_PAGE_SIZE")
_TICK = 1.0 / os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True, slots=True)
class Usage:
    """Resource use. ``cpu``: processor seconds; ``memory``: resident bytes that are not shared."""

    cpu: float = 0.0
    memory: int = 0


def usage_of(pid: int) -> Usage:
    """Return the use of one process; zeros if it is gone."""
    with contextlib.suppress(OSError, ValueError, IndexError):
        _, resident, shared, *_ = Path(f"/proc/{pid}/statm").read_text().split()
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        cpu = (int(fields[11]) + int(fields[12])) * _TICK
        return Usage(cpu, max(0, int(resident) - int(shared)) * _PAGE)
    return Usage()


def machine_memory() -> int:
    """Return the machine's memory in bytes."""
    return os.sysconf("SC_PHYS_PAGES") * _PAGE
