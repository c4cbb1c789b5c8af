"""Identity of an installation for processes that wait to be forked: folder and name of a socket, stamp of the sources.

Imports little, because every command that may start warm reads it first.
"""

from __future__ import annotations

import os
import stat
import sys
from _blake2 import blake2b  # hashlib, which has it from there, would load OpenSSL
from collections.abc import Iterator, Mapping

WARM = "ROBOGLOT_WARM"  # 0: no command starts warm; 1: even where CI is set
PACKAGE = __file__.rsplit(os.sep, 2)[0]
# What changes an interpreter or a library while it is loaded, so that a fork with other values would differ.
OF_THE_INTERPRETER = (
    *("PYTHON", "LC_", "LANG", "NUMBA_", "OPENBLAS_", "OMP_", "MKL_", "GRPC_", "LD_", "MALLOC_"),
    *("FORCE_COLOR", "PY_COLORS", "GITHUB_ACTIONS", "TERMINAL_WIDTH", "_TYPER_", "TYPER_"),  # read by Typer
)
IN_CI = ("CI", "BUILD_BUILDID", "CODEBUILD_BUILD_ID", "JENKINS_URL", "TEAMCITY_VERSION", "TF_BUILD")
LOADED = (".py", ".toml", ".json", ".sql", ".gz")  # files of the package that a parent may have read
CREDENTIALS = ("Uid:", "Gid:", "Groups:", "CapEff:", "CapBnd:", "NoNewPrivs:", "Seccomp:")
NAMESPACES = ("cgroup", "ipc", "mnt", "net", "pid", "user", "uts")
PATH_MAX = 107  # bytes of a socket's path


def is_wanted(environment: Mapping[str, str]) -> bool:
    """Return True if commands may start warm here. In CI they do not: nothing should outlive its job."""
    choice = environment.get(WARM, "")
    return (
        sys.platform == "linux" and choice != "0" and (choice == "1" or not any(map(environment.__contains__, IN_CI)))
    )


def folder_of(environment: Mapping[str, str]) -> str:
    """Return the folder for sockets, which only its owner can open. Raises OSError if another user made it."""
    runtime = environment.get("XDG_RUNTIME_DIR")
    folder = f"{runtime}/roboglot" if runtime else f"/tmp/roboglot-{os.getuid()}"
    os.makedirs(folder, mode=0o700, exist_ok=True)
    found = os.lstat(folder)
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        raise PermissionError(f"{folder} is not a folder of our own")
    return folder


def socket_path(environment: Mapping[str, str], *marks: str) -> str:
    """Return the socket of this installation's parent, or of another process, that differs with ``marks``.

    Raises OSError, also if its path is too long for a socket.
    """
    path = f"{folder_of(environment)}/{name_of(environment, *marks)}.socket"
    if len(os.fsencode(path)) > PATH_MAX:
        raise OSError(f"{path} is too long for a socket")
    return path


def name_of(environment: Mapping[str, str], *marks: str) -> str:
    """Return a name that differs with installation, user, interpreter settings, priority, rights and ``marks``."""
    parts = [sys.prefix, sys.executable, sys.version, PACKAGE, *marks]
    parts += sorted(f"{key}={value}" for key, value in environment.items() if key.startswith(OF_THE_INTERPRETER))
    parts += [str(os.getpriority(os.PRIO_PROCESS, 0)), str(os.sched_getscheduler(0)), *rights_of("self")]
    return blake2b(os.fsencode("\0".join(parts)), digest_size=8).hexdigest()


def rights_of(process: int | str) -> list[str]:
    """Return the credentials and namespaces of a process. Raises OSError."""
    with open(f"/proc/{process}/status", encoding="utf-8", errors="replace") as status:
        rights = [line for line in status if line.startswith(CREDENTIALS)]
    ours = [kind for kind in NAMESPACES if os.path.exists(f"/proc/self/ns/{kind}")]
    return rights + [os.readlink(f"/proc/{process}/ns/{kind}") for kind in ours]


def stamp() -> str:
    """Return a text that changes when a file of the package or an installed library changes."""
    count = size = newest = 0
    for entry in _sources(PACKAGE):
        found = entry.stat()
        count, size, newest = count + 1, size + found.st_size, max(newest, found.st_mtime_ns)
    libraries = [str(os.stat(path).st_mtime_ns) for path in sys.path if path.endswith("site-packages")]
    return " ".join((str(count), str(size), str(newest), *libraries))


def _sources(folder: str) -> Iterator[os.DirEntry[str]]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith(LOADED):
                yield entry
            elif entry.name != "__pycache__" and entry.is_dir(follow_symlinks=False):
                yield from _sources(entry.path)
