"""Metering of coroutines: the serving thread's time, without that of other work between two steps."""

from __future__ import annotations

import time
from collections.abc import Callable, Coroutine, Generator
from types import coroutine
from typing import TypeVar

T = TypeVar("T")


@coroutine
def metered(work: Coroutine[object, None, T], charge: Callable[[float], None]) -> Generator[object, None, T]:
    """Return the result of ``work``; charge the thread time of each of its steps."""
    step: Callable[[], object] = lambda: work.send(None)  # noqa: E731 - the next step depends on the last wait's end
    try:
        while True:
            began = time.thread_time()
            try:
                awaited = step()
            except StopIteration as stop:
                result: T = stop.value
                return result
            finally:
                charge(time.thread_time() - began)
            try:
                yield awaited
            except BaseException as error:  # noqa: BLE001 - thrown into the work
                thrown = error
                step = lambda: work.throw(thrown)  # noqa: B023, E731
            else:
                step = lambda: work.send(None)  # noqa: E731
    finally:
        work.close()
