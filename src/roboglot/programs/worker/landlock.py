"""Denies all files by Landlock, if the kernel has it: one more layer behind seccomp. Knows nothing about programs."""

from __future__ import annotations

import ctypes
import os
import struct

_CREATE_RULESET, _RESTRICT_SELF = 444, 446  # the same numbers on every architecture
_VERSION_QUERY = 1
# Rights by ABI version of the kernel: files, network, scopes.
_FILE_BITS = {1: 13, 2: 14, 3: 15, 4: 15, 5: 16}
_NETWORK, _SCOPES = 0b11, 0b11


def deny_everything(libc: ctypes.CDLL) -> int:
    """Give up every right that Landlock covers; needs no_new_privs. Return the ABI version, 0 if unavailable."""
    version = int(libc.syscall(_CREATE_RULESET, None, 0, _VERSION_QUERY))
    if version <= 0:
        return 0
    files = (1 << _FILE_BITS.get(version, 16)) - 1
    attributes = struct.pack("=QQQ", files, _NETWORK if version >= 4 else 0, _SCOPES if version >= 6 else 0)
    size = 8 if version < 4 else 16 if version < 6 else 24
    ruleset = int(libc.syscall(_CREATE_RULESET, attributes, size, 0))
    if ruleset < 0:
        return 0
    try:
        return version if libc.syscall(_RESTRICT_SELF, ruleset, 0) == 0 else 0
    finally:
        os.close(ruleset)
