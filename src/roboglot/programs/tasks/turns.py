"""Changes of tasks, one at a time; runs interrupted by the server's end are restored before the first."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from roboglot.model.clock import Clock
from roboglot.programs.stores import ProgramStore
from roboglot.programs.tasks.runner import Runner


class Turns:
    """``lost``: headers of the interrupted runs' journals, by the task's id. While ``closed``, none is restored."""

    def __init__(
        self, clock: Clock, lock: asyncio.Lock, store: ProgramStore, runner: Runner, lost: dict[str, str]
    ) -> None:
        self._clock, self._lock, self._store, self._runner, self.lost = clock, lock, store, runner, lost
        self.closed = True

    @asynccontextmanager
    async def take(self) -> AsyncIterator[None]:
        """Hold the lock, once interrupted runs are restored: suspended, until a user recovers them."""
        async with self._lock:
            with self._clock.holding():
                while self.lost and not self.closed:
                    await self._restore(next(iter(self.lost)))
                yield

    async def _restore(self, id: str) -> None:
        """Restore an interrupted run, if its task is stored still."""
        try:
            if (task := await self._store.get(id)) is not None:
                await self._runner.revive(task, self.lost[id])
        finally:
            del self.lost[id]

    async def restore(self) -> None:
        """Restore the interrupted runs."""
        async with self.take():
            pass
