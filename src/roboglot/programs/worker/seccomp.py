"""The last layer: a seccomp filter that leaves a program almost no system calls.

Pure ctypes, no library. A program may read and write its one socket, allocate memory that cannot be executed, read
clocks, get random bytes and exit. All other calls return EPERM; a call of another architecture kills the process.
Knows x86_64 and aarch64.
"""

from __future__ import annotations

import ctypes
import errno
import os
import struct

SOCKET_FD = 3
"""A program's only descriptor."""

_PR_SET_SECCOMP = 22
_SECCOMP_MODE_FILTER = 2
_KILL_PROCESS, _ERRNO, _ALLOW = 0x80000000, 0x00050000, 0x7FFF0000
_PROT_EXEC = 4

# Offsets in struct seccomp_data: number, architecture, then the arguments (low halves first: both machines
# are little-endian).
_NUMBER, _ARCHITECTURE, _ARGUMENTS = 0, 4, 16

_LOAD, _EQUAL, _BITS, _RETURN = 0x20, 0x15, 0x45, 0x06  # BPF: LD|W|ABS, JMP|JEQ|K, JMP|JSET|K, RET|K

# name: (x86_64, aarch64); None if the architecture lacks the call.
_FREE: dict[str, tuple[int | None, int | None]] = {
    "munmap": (11, 215),
    "brk": (12, 214),
    "mremap": (25, 216),
    "madvise": (28, 233),
    "rt_sigreturn": (15, 139),
    "restart_syscall": (219, 128),
    "sched_yield": (24, 124),
    "futex": (202, 98),
    "clock_gettime": (228, 113),
    "clock_getres": (229, 114),
    "gettimeofday": (96, 169),
    "getrandom": (318, 278),
    "exit": (60, 93),
    "exit_group": (231, 94),
}
_ON_SOCKET: dict[str, tuple[int, int]] = {"read": (0, 63), "write": (1, 64)}
_NOT_EXECUTABLE: dict[str, tuple[int, int]] = {"mmap": (9, 222), "mprotect": (10, 226)}
_AUDIT_ARCHITECTURE = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}


class SeccompUnavailable(OSError):
    """The filter cannot be loaded; the text says why."""


def program(machine: str) -> bytes:
    """Return the filter as BPF instructions for a machine (``os.uname().machine``).

    Raises SeccompUnavailable for a machine without a table.
    """
    if machine not in _AUDIT_ARCHITECTURE:
        raise SeccompUnavailable(errno.ENOSYS, f"no system call table for {machine}")
    column = list(_AUDIT_ARCHITECTURE).index(machine)
    code = [
        _instruction(_LOAD, 0, 0, _ARCHITECTURE),
        _instruction(_EQUAL, 1, 0, _AUDIT_ARCHITECTURE[machine]),
        _instruction(_RETURN, 0, 0, _KILL_PROCESS),
        _instruction(_LOAD, 0, 0, _NUMBER),
    ]
    for socket_numbers in _ON_SOCKET.values():  # first, as each call of the host makes two of these
        code += _if_number(socket_numbers[column], 0, _instruction(_EQUAL, 0, 1, SOCKET_FD), allow_first=True)
    for numbers in _FREE.values():
        number = numbers[column]
        if number is not None:
            code += [_instruction(_EQUAL, 0, 1, number), _instruction(_RETURN, 0, 0, _ALLOW)]
    for memory_numbers in _NOT_EXECUTABLE.values():
        code += _if_number(memory_numbers[column], 2, _instruction(_BITS, 0, 1, _PROT_EXEC), allow_first=False)
    code.append(_instruction(_RETURN, 0, 0, _ERRNO | errno.EPERM))
    return b"".join(code)


def _if_number(number: int, argument: int, test: bytes, *, allow_first: bool) -> list[bytes]:
    """Return the filter of one system call: load an argument's low half, test it, and allow or refuse."""
    verdicts = (_ALLOW, _ERRNO | errno.EPERM) if allow_first else (_ERRNO | errno.EPERM, _ALLOW)
    return [
        _instruction(_EQUAL, 0, 4, number),
        _instruction(_LOAD, 0, 0, _ARGUMENTS + 8 * argument),
        test,
        *(_instruction(_RETURN, 0, 0, verdict) for verdict in verdicts),
    ]


def _instruction(code: int, on_true: int, on_false: int, value: int) -> bytes:
    return struct.pack("=HBBI", code, on_true, on_false, value)


class _SockFprog(ctypes.Structure):
    _fields_ = [("length", ctypes.c_ushort), ("filter", ctypes.c_void_p)]


def load(libc: ctypes.CDLL, code: bytes | None = None) -> None:
    """Install the filter for this thread, irrevocably. Needs no_new_privs. Raises SeccompUnavailable."""
    code = program(os.uname().machine) if code is None else code
    buffer = ctypes.create_string_buffer(code, len(code))
    fprog = _SockFprog(len(code) // 8, ctypes.cast(buffer, ctypes.c_void_p))
    if libc.prctl(_PR_SET_SECCOMP, _SECCOMP_MODE_FILTER, ctypes.addressof(fprog), 0, 0) != 0:
        number = ctypes.get_errno()
        raise SeccompUnavailable(number, f"the kernel refuses a seccomp filter (errno {number})")
