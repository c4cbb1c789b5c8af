"""One control group for all programs, so that together they yield to the server if processor time is short.

Niceness weighs a process against its neighbours: three hundred nice ones still outweigh one server. Needs a kernel with
control groups and the right to make one (root, or a delegated hierarchy); otherwise only niceness is used. Every call
may block for tens of milliseconds: make it in a thread. Knows process numbers, no programs.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

WEIGHTS = (("cpu", "cpu.shares", "256"), ("cpu,cpuacct", "cpu.shares", "256"), ("", "cpu.weight", "25"))
"""Possible processor controllers, their weight files, and a quarter of the default weight: with the least possible
weight, programs would stand still on a machine that something else keeps busy."""

SESSION_NICENESS = 10
"""Niceness of the zygote's session: kernels with autogroups weigh sessions by it, not by that of processes."""


class ProcessorGroup:
    """Control group of this server's programs, inside the server's own; ``there``: True if it could be made."""

    def __init__(self, root: Path = Path("/sys/fs/cgroup"), proc: Path = Path("/proc")) -> None:
        self._root = root
        self._proc = proc
        self._folder: Path | None = None

    @property
    def there(self) -> bool:
        """True if the group exists, so that programs can be moved into it."""
        return self._folder is not None

    def open(self) -> list[str]:
        """Make the group; return its name as a layer of the engine, or nothing if that is not permitted."""
        paths: dict[str, str] = {}
        with contextlib.suppress(OSError):
            for line in (self._proc / "self" / "cgroup").read_text().splitlines():
                _, controllers, path = line.split(":", 2)
                paths[controllers] = path.strip("/")
        for controllers, file, value in WEIGHTS:
            if self._folder is None and controllers in paths:
                parent = self._root / controllers / paths[controllers]
                self._remove_abandoned(parent)
                self._make(parent / f"roboglot-programs-{os.getpid()}", file, value)
        return ["cpu group"] if self._folder else []

    def step_aside(self, pid: int) -> None:
        """Lower the weight of the process's session, for kernels with autogroups."""
        with contextlib.suppress(OSError):
            (self._proc / str(pid) / "autogroup").write_text(str(SESSION_NICENESS))

    def take(self, pid: int, parent: int) -> None:
        """Move a process into the group if it is still a child of ``parent``."""
        with contextlib.suppress(OSError, IndexError, ValueError):
            after_name = (self._proc / str(pid) / "stat").read_text().rpartition(")")[2]
            if self._folder is not None and int(after_name.split()[1]) == parent:
                (self._folder / "cgroup.procs").write_text(str(pid))

    def close(self) -> None:
        """Remove the group, once all programs have ended. Idempotent."""
        if self._folder is not None:
            with contextlib.suppress(OSError):
                self._folder.rmdir()
            self._folder = None

    def _make(self, folder: Path, file: str, value: str) -> None:
        with contextlib.suppress(OSError):
            folder.mkdir(exist_ok=True)
            if (folder / file).exists():
                (folder / file).write_text(value)
                self._folder = folder
            else:
                folder.rmdir()  # the controller for processor time is not available here

    def _remove_abandoned(self, parent: Path) -> None:
        """Remove the groups of killed servers; the kernel refuses to remove a group in use."""
        for folder in parent.glob("roboglot-programs-*"):
            if not (self._proc / folder.name.rpartition("-")[2]).exists():
                with contextlib.suppress(OSError):
                    folder.rmdir()
