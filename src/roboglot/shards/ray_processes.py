"""Processes of Ray that this program has started, and with one of which Ray ends: it does not start them again.

Ray's own health checks would take a minute to report that. This module does not depend on Ray.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from roboglot.hosting.process import has_ended

NAMES = "raylet", "gcs_server"


class RayProcesses:
    """Those that run when it is made, not those of an earlier Ray; none where Ray was started elsewhere."""

    def __init__(self) -> None:
        self._pids = {pid: name for pid, name in _children() if name in NAMES and not has_ended(pid)}

    def why_lost(self) -> str:
        """Return why Ray no longer works; "" if it works."""
        for pid, name in self._pids.items():
            if has_ended(pid):
                return f"{name}, a process of Ray, has ended, and Ray with it; start again"
        return ""


def _children() -> Iterator[tuple[int, str]]:
    """Yield process id and name of each child of this process."""
    own = str(os.getpid())
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has just ended
            name, _, rest = stat.read_text("utf-8", "replace").partition("(")[2].rpartition(")")
            if rest.split()[1] == own:
                yield int(stat.parent.name), name
