"""Work outside the event loop: in low-priority threads, and in one that does not delay the program's end."""

from __future__ import annotations

import asyncio
import gc
import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import copy_context
from functools import cache
from typing import TypeVar

R = TypeVar("R")
NICENESS = 10  # of the threads, which get a tenth of a core while the event loop is busy


async def beside(job: Callable[[], R]) -> R:
    """Run ``job`` in a pool with one thread per processor, and return its result."""
    return await asyncio.get_running_loop().run_in_executor(_pool(os.getpid()), copy_context().run, job)


async def load(job: Callable[[], R]) -> R:
    """Return the result of ``job``, which imports modules, in a separate thread.

    Unlike an executor's threads, this one is not joined when the loop or the interpreter ends: importing and compiling
    with Numba takes seconds, and nothing is lost if the process ends meanwhile.
    """
    result: Future[R] = Future()

    def work() -> None:
        result.set_running_or_notify_cancel()  # no cancelling from here on
        modules = len(sys.modules)
        try:
            found = job()
            if len(sys.modules) > modules:
                gc.freeze()
        except BaseException as error:  # noqa: BLE001
            result.set_exception(error)
        else:
            result.set_result(found)

    threading.Thread(target=work, name="loading", daemon=True).start()
    return await asyncio.wrap_future(result)


@cache
def _pool(_process: int) -> ThreadPoolExecutor:
    """Return the pool of a process; a forked one makes its own."""
    return ThreadPoolExecutor(max(2, os.cpu_count() or 1), "beside", initializer=_give_way)


def _give_way() -> None:
    if hasattr(os, "setpriority"):
        identifier = threading.get_native_id()  # on Linux each thread has its own priority
        os.setpriority(os.PRIO_PROCESS, identifier, max(NICENESS, os.getpriority(os.PRIO_PROCESS, identifier)))
