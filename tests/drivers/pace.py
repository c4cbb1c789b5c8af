"""Robot time that tests drive, beside threads that keep no robot time: gRPC's.

A test lets a step of robot time pass, then ``settle`` waits until the threads have done all that follows from it: at
once on a quiet machine, for as long as it takes on a busy one.
"""

import asyncio
import os
import threading
import time

ROUNDS = 3  # idle samples in a row: a thread that waits for Python's lock seems to sleep
GLANCE = 0.0005  # real s between two samples of a working thread
SETTLE_MAX = 2.0  # real s: some threads never rest


async def settle(patience: float = SETTLE_MAX) -> None:
    """Wait until neither the event loop nor another thread of this process has anything to do.

    What lies in a socket of this machine has woken the thread that reads it; another process is not waited for.
    """
    ready = asyncio.get_running_loop()._ready  # type: ignore[attr-defined]
    deadline, quiet = time.monotonic() + patience, 0
    while quiet < ROUNDS:
        await asyncio.sleep(0)
        if ready:
            quiet = 0
        elif not _working():
            quiet += 1
        elif time.monotonic() > deadline:
            return
        else:
            quiet = 0
            await asyncio.sleep(GLANCE)


def _working() -> bool:
    """Return whether another thread of this process runs, or would if a processor were free."""
    own = threading.get_native_id()
    return any(_is_running(name) for name in os.listdir("/proc/self/task") if int(name) != own)


def _is_running(thread: str) -> bool:
    try:
        file = os.open(f"/proc/self/task/{thread}/stat", os.O_RDONLY)
    except FileNotFoundError:  # it has ended
        return False
    try:
        state = os.read(file, 256).rpartition(b") ")[2][:1]
    except ProcessLookupError:
        state = b"X"
    finally:
        os.close(file)
    return state in (b"R", b"D")
