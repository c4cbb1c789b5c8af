"""Ends processes that a command has left behind: by a mark in their environment, or as descendants.

Commands of a scenario may start others in sessions of their own, which the end of a process group does not reach. Where
the system has no ``/proc`` (macOS), none is found.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import select
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

from roboglot.hosting.process import running

MARK = "ROBOGLOT_SCENARIO"  # environment variable; a scenario within another adds to the other's mark
SET_CHILD_SUBREAPER = 36  # of prctl(2)
ROUNDS_MAX = 20  # searches; processes that are ended may start others meanwhile
END_SECONDS_MAX = 1.0  # for a killed process to end
Find = Callable[[], Iterator[int]]


def adopt_orphans() -> None:
    """Become the parent of descendants whose parents end, so that ``end_descendants`` finds them."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def end_descendants() -> None:
    """Kill all descendants of this process."""
    _end_all(_descendants)


def end_marked(mark: str) -> None:
    """Kill all processes with this mark, or one that begins with it, in their environment."""
    _end_all(lambda: _marked(mark))


def _end_all(find: Find) -> None:
    for _ in range(ROUNDS_MAX):
        if not (found := list(find())):
            return
        for pid in found:
            _kill(pid, find)


def _kill(pid: int, find: Find) -> None:
    """Kill a process, and wait for its end; not another one that has its number by now."""
    with contextlib.suppress(OSError, AttributeError):
        handle = os.pidfd_open(pid)
        try:
            if pid in find():
                signal.pidfd_send_signal(handle, signal.SIGKILL)
                select.select([handle], [], [], END_SECONDS_MAX)
        finally:
            os.close(handle)


def _descendants() -> Iterator[int]:
    every = [one for one in running() if not one.has_ended]
    known = {os.getpid()}
    while new := [one.pid for one in every if one.parent in known and one.pid not in known]:
        known.update(new)
        yield from new


def _marked(mark: str) -> Iterator[int]:
    wanted = f"{MARK}={mark}".encode()
    for place in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):  # it has ended, or is another user's
            values = place.read_bytes().split(b"\0")
            if any(value == wanted or value.startswith(wanted + b":") for value in values):
                yield int(place.parent.name)
