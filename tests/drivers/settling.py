"""Waiting for threads that keep no robot time, such as gRPC's, in tests that advance robot time.

A test lets a step of robot time pass, then ``settle`` waits until the threads have done all that follows from it: at
once on a quiet machine, for as long as it takes on a busy one.
"""

import asyncio
import os
import threading
import time
from typing import TypeVar

from roboglot.model.clock import LockstepClock, _ready

T = TypeVar("T")
ROUNDS = 3  # idle samples in a row: a thread that waits for Python's lock seems to sleep
GLANCE = 0.0005  # real s between two samples of a working thread
SETTLE_MAX = 2.0  # real s: some threads never rest
STAT = 64  # bytes, up to the state of a thread
_files = dict[str, int]()


async def settle(patience: float = SETTLE_MAX) -> None:
    """Wait until neither the event loop nor another thread of this process has anything to do.

    What lies in a socket of this machine has woken the thread that reads it; another process is not waited for.
    """
    ready = _ready()
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


async def late(answer: asyncio.Future[T], seconds: float, clock: LockstepClock) -> T:
    """Return the answer, which comes after ``seconds`` of robot time, and within 20 s more."""
    began = clock.time()
    while not answer.done():
        assert clock.time() < began + seconds + 20.0, "no answer"
        await settle()
        await clock.advance(0.1)
    assert clock.time() > began + seconds - 0.05, "too soon"
    return await answer


def _working() -> bool:
    """Return whether another thread of this process runs, or would if a processor were free."""
    own = str(threading.get_native_id())
    return any(_is_running(name) for name in os.listdir("/proc/self/task") if name != own)


def _is_running(thread: str) -> bool:
    """Return its state; its file is kept open, as opening it takes longer than reading."""
    while True:
        try:
            file = _files.get(thread)
            if file is None:
                file = _files[thread] = os.open(f"/proc/self/task/{thread}/stat", os.O_RDONLY)
            said = os.pread(file, STAT, 0)
        except FileNotFoundError:  # it has ended
            return False
        except ProcessLookupError:  # it has ended; another may have its number by now
            os.close(_files.pop(thread))
        else:
            state = said[said.rfind(b") ") + 2 :][:1]
            return state in (b"R", b"D")
