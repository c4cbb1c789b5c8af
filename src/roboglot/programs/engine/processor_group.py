"""One control group for all programs, so that they step back behind the server together when processors are short.

Niceness weighs a process against its neighbours: three hundred nice ones still outweigh one server. Needs a kernel with
control groups and the right to make one (root, or a delegated hierarchy); without, niceness has to do. Everything here
blocks, for tens of milliseconds at times: call it in a thread. Knows process numbers and nothing of programs.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

WEIGHTS = (("cpu", "cpu.shares", "256"), ("cpu,cpuacct", "cpu.shares", "256"), ("", "cpu.weight", "25"))
"""Where the processor controller may be, the file of the weight, and a quarter of what others have: with the least
that is possible, programs would stand still on a machine that something else keeps busy."""

SESSION_NICENESS = 10
"""Of the zygote's session: kernels with autogroups do not look at the niceness of its processes."""


class ProcessorGroup:
    """The group of this server's programs, below the server's own. ``there`` is whether it could be made."""

    def __init__(self, root: Path = Path("/sys/fs/cgroup"), proc: Path = Path("/proc")) -> None:
        self._root = root
        self._proc = proc
        self._folder: Path | None = None

    @property
    def there(self) -> bool:
        """True if programs can be moved into it."""
        return self._folder is not None

    def open(self) -> list[str]:
        """Make the group; its name among the engine's layers, nothing if that isn't permitted."""
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
        """Have the process's session weigh as little as its programs, where sessions are weighed instead of them."""
        with contextlib.suppress(OSError):
            (self._proc / str(pid) / "autogroup").write_text(str(SESSION_NICENESS))

    def take(self, pid: int, parent: int) -> None:
        """Move a process into the group if it is still a child of ``parent``."""
        with contextlib.suppress(OSError, IndexError, ValueError):
            after_name = (self._proc / str(pid) / "stat").read_text().rpartition(")")[2]
            if self._folder is not None and int(after_name.split()[1]) == parent:
                (self._folder / "cgroup.procs").write_text(str(pid))

    def close(self) -> None:
        """Remove the group, which is empty once the programs have ended. Idempotent."""
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
        """Groups of servers that were killed; the kernel refuses to remove one that is in use."""
        for folder in parent.glob("roboglot-programs-*"):
            if not (self._proc / folder.name.rpartition("-")[2]).exists():
                with contextlib.suppress(OSError):
                    folder.rmdir()
