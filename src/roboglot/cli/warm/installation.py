"""The installation as a warm parent has loaded it: its socket's folder, its name there, and the state of its sources.

Imports little, because every command that may start warm reads it first.
"""

from __future__ import annotations

import hashlib
import os
import stat
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

WARM = "ROBOGLOT_WARM"  # 0: no command starts warm; 1: even where CI is set
PACKAGE = Path(__file__).parents[2]
# What changes an interpreter or a library while it is loaded, so that a fork with other values would differ.
OF_THE_INTERPRETER = ("PYTHON", "LC_", "LANG", "NUMBA_", "OPENBLAS_", "OMP_", "MKL_", "GRPC_", "LD_", "MALLOC_")
CREDENTIALS = ("Uid:", "Gid:", "Groups:", "CapEff:", "CapBnd:", "NoNewPrivs:", "Seccomp:")
NAMESPACES = ("cgroup", "ipc", "mnt", "net", "pid", "user", "uts")


def is_wanted(environment: Mapping[str, str]) -> bool:
    """Return True if commands may start warm here. In CI they do not: nothing should outlive its job."""
    choice = environment.get(WARM, "")
    return sys.platform == "linux" and choice != "0" and (choice == "1" or "CI" not in environment)


def folder_of(environment: Mapping[str, str]) -> Path:
    """Return the folder for sockets, which only its owner can open. Raises OSError if another user made it."""
    runtime = environment.get("XDG_RUNTIME_DIR")
    folder = Path(runtime) / "roboglot" if runtime else Path("/tmp") / f"roboglot-{os.getuid()}"
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        raise PermissionError(f"{folder} is not a folder of our own")
    return folder


def name_of(environment: Mapping[str, str]) -> str:
    """Return the name of the parent for this installation, user, interpreter settings, rights and namespaces."""
    parts = [sys.prefix, sys.executable, sys.version, str(PACKAGE)]
    parts += sorted(f"{key}={value}" for key, value in environment.items() if key.startswith(OF_THE_INTERPRETER))
    with open("/proc/self/status", encoding="utf-8") as status:
        parts += [line for line in status if line.startswith(CREDENTIALS)]
    parts += [os.readlink(f"/proc/self/ns/{kind}") for kind in NAMESPACES if os.path.exists(f"/proc/self/ns/{kind}")]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]


def stamp() -> str:
    """Return a text that changes when a source file or an installed package changes."""
    count = size = newest = 0
    for entry in _sources(str(PACKAGE)):
        found = entry.stat()
        count, size, newest = count + 1, size + found.st_size, max(newest, found.st_mtime_ns)
    libraries = [str(os.stat(path).st_mtime_ns) for path in sys.path if path.endswith("site-packages")]
    return " ".join((str(count), str(size), str(newest), *libraries))


def _sources(folder: str) -> Iterator[os.DirEntry[str]]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith(".py"):
                yield entry
            elif entry.name != "__pycache__" and entry.is_dir(follow_symlinks=False):
                yield from _sources(entry.path)
