"""Coroutines that start at once and become tasks only when they have to wait, which most requests never do.

A task that does not wait costs two turns of the event loop. Before its first wait, a coroutine has no current task, so
it may not begin with ``asyncio.timeout``. Knows no clock.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Generator
from contextvars import Context, copy_context
from types import TracebackType


def begin(
    work: Coroutine[object, object, None], name: str, context: Context | None = None
) -> asyncio.Task[None] | None:
    """Run ``work`` until its first wait; return the task that continues it, None if it has ended.

    Raises errors of ``work`` before that wait. ``work`` has its own context, as in a task: ``context`` or a copy.
    """
    context = context or copy_context()
    try:
        awaited = context.run(work.send, None)
    except StopIteration:
        return None
    return asyncio.get_running_loop().create_task(_Rest(work, awaited), name=name, context=context)


class _Rest(Coroutine[object, object, None]):
    """The rest of a coroutine, for its task; cancelling the task cancels the coroutine at its first wait."""

    __slots__ = ("_awaited", "_fresh", "_work")

    def __init__(self, work: Coroutine[object, object, None], awaited: object) -> None:
        self._work, self._awaited = work, awaited
        self._fresh = True  # True until the task has got the first awaited object

    def send(self, value: object) -> object:
        if not self._fresh:
            return self._work.send(value)
        self._fresh = False
        return self._awaited

    def throw(
        self, error: BaseException | type[BaseException], _value: object = None, _at: TracebackType | None = None, /
    ) -> object:
        self._fresh = False
        return self._work.throw(error if isinstance(error, BaseException) else error())

    def close(self) -> None:
        self._work.close()

    def __await__(self) -> Generator[object, object, None]:
        raise TypeError("only a task goes on with it")
