"""Processes of Ray: their priority, and those that this program has started, with one of which Ray ends.

Ray does not start them again; its own health checks would take a minute to report that. This module does not depend on
Ray.
"""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Collection
from pathlib import Path

from roboglot.hosting.process import has_ended, running

NAMES = "raylet", "gcs_server"
NICENESS = "RAY_worker_niceness"  # what Ray adds to that of its own processes; 15 if this is not set


def keep_priority() -> None:
    """Give this worker of Ray the priority of its parent, the raylet, if the system permits; a user's setting stays.

    Ray lowers it by 15: beside busy processes, the first nursery of a node then took 70 s to load.
    """
    if NICENESS in os.environ:
        return
    with contextlib.suppress(OSError):
        parent = os.getppid()
        if Path(f"/proc/{parent}/comm").read_text().strip() not in NAMES:
            return
        wanted = os.getpriority(os.PRIO_PROCESS, parent)
        for thread in os.listdir("/proc/self/task"):  # Linux has a priority for each
            os.setpriority(os.PRIO_PROCESS, int(thread), wanted)


class RayProcesses:
    """Those that run when it is made, not those of an earlier Ray; none where Ray was started elsewhere."""

    def __init__(self) -> None:
        self._pids = {
            one.pid: one.name
            for one in running()
            if one.parent == os.getpid() and one.name in NAMES and not one.has_ended
        }

    def why_lost(self) -> str:
        """Return why Ray no longer works; "" if it works."""
        for pid, name in self._pids.items():
            if has_ended(pid):
                return f"{name}, a process of Ray, has ended, and Ray with it; start again"
        return ""


def children() -> set[int]:
    """Return the process ids of this program's children."""
    return {one.pid for one in running() if one.parent == os.getpid() and not one.has_ended}


def end_children(*, but: Collection[int]) -> None:
    """Kill this program's children, except some that it had before."""
    for pid in children().difference(but):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
