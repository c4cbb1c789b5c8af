"""The jail, in two steps: rights that the zygote gives up for all programs, and rights that each program gives up.

The order matters: descriptors, then namespaces and user, no_new_privs, Landlock, limits, and the system call filter
last. The filter is required; every other layer is added if the machine has it. Knows nothing about programs or the
contents of sockets.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
import signal

from roboglot.programs.worker import landlock, seccomp
from roboglot.values import dataclass

_PR_SET_PDEATHSIG, _PR_SET_DUMPABLE, _PR_SET_NO_NEW_PRIVS = 1, 4, 38
_CLONE_NEWUTS, _CLONE_NEWIPC, _CLONE_NEWUSER, _CLONE_NEWNET = 0x04000000, 0x08000000, 0x10000000, 0x40000000
_NOBODY = 65534
_NICENESS = 10

CPU_GRACE = 1
"""Seconds between SIGXCPU and SIGKILL for a program over its CPU limit (RLIMIT_CPU soft and hard)."""


@dataclass(frozen=True, slots=True)
class Quota:
    """Kernel limits of one program: bytes in addition to an empty program's, and CPU seconds."""

    memory: int
    cpu: int


def open_libc() -> ctypes.CDLL:
    """Return the C library, with errno saved after each call."""
    libc = ctypes.CDLL(None, use_errno=True)
    libc.prctl.argtypes = [ctypes.c_int, *[ctypes.c_ulong] * 4]
    libc.syscall.restype = ctypes.c_long
    return libc


def confine_zygote(libc: ctypes.CDLL) -> list[str]:
    """Give up rights that no program needs; return the names of the layers. Import all modules before."""
    layers = []
    isolated = _CLONE_NEWNET | _CLONE_NEWIPC | _CLONE_NEWUTS
    if libc.unshare(isolated) == 0 or libc.unshare(isolated | _CLONE_NEWUSER) == 0:
        layers.append("namespaces")
    if os.geteuid() == 0:
        with contextlib.suppress(OSError):  # a container may withhold the capability
            os.setgroups([])
            os.setresgid(_NOBODY, _NOBODY, _NOBODY)
            os.setresuid(_NOBODY, _NOBODY, _NOBODY)
            layers.append("nobody")
    _prctl(libc, _PR_SET_NO_NEW_PRIVS, 1)
    _prctl(libc, _PR_SET_DUMPABLE, 0)
    version = landlock.deny_everything(libc)
    if version:
        layers.append(f"landlock {version}")
    return layers


def confine_program(libc: ctypes.CDLL, parent: int, used: int, quota: Quota, code: bytes) -> None:
    """Confine a new child; afterwards it can use only its socket.

    ``used``: address space in use, bytes; ``code``: the filter, empty for none. Raises OSError (SeccompUnavailable);
    the child must then exit.
    """
    _prctl(libc, _PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # the zygote died before the line above
        os._exit(1)
    with contextlib.suppress(OSError):
        os.nice(_NICENESS)  # below the server and the zygote, which must stay responsive
    _prctl(libc, _PR_SET_NO_NEW_PRIVS, 1)
    _prctl(libc, _PR_SET_DUMPABLE, 0)
    limits = {
        resource.RLIMIT_AS: (used + quota.memory, used + quota.memory),
        resource.RLIMIT_CPU: (quota.cpu, quota.cpu + CPU_GRACE),
        resource.RLIMIT_NPROC: (0, 0),
        resource.RLIMIT_FSIZE: (0, 0),
        resource.RLIMIT_NOFILE: (seccomp.SOCKET_FD + 1, seccomp.SOCKET_FD + 1),
        resource.RLIMIT_CORE: (0, 0),
        resource.RLIMIT_MEMLOCK: (0, 0),
        resource.RLIMIT_MSGQUEUE: (0, 0),
    }
    for kind, (soft, hard) in limits.items():
        _, ceiling = resource.getrlimit(kind)
        if ceiling != resource.RLIM_INFINITY:
            soft, hard = min(soft, ceiling), min(hard, ceiling)
        resource.setrlimit(kind, (soft, hard))
    if code:
        seccomp.load(libc, code)


def filter_code() -> bytes:
    """Return the filter for this machine. Raises SeccompUnavailable."""
    return seccomp.program(os.uname().machine)


def _prctl(libc: ctypes.CDLL, option: int, value: int) -> None:
    if libc.prctl(option, value, 0, 0, 0) != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"prctl({option}): {os.strerror(number)}")
