"""The loading of the saved map at a start, for which changes of the map wait: it would undo them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine


class MapStart:
    """Starts of a map keeper, each a task that runs ``start``."""

    def __init__(self, start: Callable[[], Coroutine[None, None, None]]) -> None:
        self._start = start
        self._task: asyncio.Task[None] | None = None

    def begin(self) -> asyncio.Task[None]:
        """Return a task that starts, for which ``ended`` waits from now on."""
        self._task = asyncio.get_running_loop().create_task(self._start(), name="loading the saved map")
        return self._task

    async def ended(self) -> None:
        """Wait for the end of a start that is under way."""
        if self._task is not None and not self._task.done():
            await asyncio.wait([self._task])
