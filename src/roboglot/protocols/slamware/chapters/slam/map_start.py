"""Loading of the saved map at a start. Changes of the map wait until it has ended, as it would undo them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine


class MapStart:
    """Runs a map keeper's ``start`` in a task, and lets changes of the map wait for its end."""

    def __init__(self, start: Callable[[], Coroutine[None, None, None]]) -> None:
        self._start = start
        self._task: asyncio.Task[None] | None = None

    def begin(self) -> asyncio.Task[None]:
        """Begin a start, for which ``ended`` waits from now on; return its task."""
        self._task = asyncio.get_running_loop().create_task(self._start(), name="loading the saved map")
        return self._task

    async def ended(self) -> None:
        """Wait for the end of a start that is under way."""
        if self._task is not None and not self._task.done():
            await asyncio.wait([self._task])
