"""The search for a robot whose link was lost: retries at growing intervals until it is found."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable

from roboglot.clients.errors import ClientError
from roboglot.model.clock import Clock

log = logging.getLogger(__name__)
BACK_OFF = (0.5, 1.0, 2.0, 5.0)  # s between attempts to reconnect; the last value repeats


class Search:
    """``attempt`` connects, or raises ClientError; ``found`` returns whether the link is up."""

    def __init__(
        self, clock: Clock, host: str, attempt: Callable[[], Awaitable[object]], found: Callable[[], bool]
    ) -> None:
        self._clock, self._host, self._attempt, self._found = clock, host, attempt, found
        self._task: asyncio.Task[None] | None = None
        self._hooks: list[Callable[[], Awaitable[object]]] = []

    def at_find(self, hook: Callable[[], Awaitable[object]]) -> None:
        """Await ``hook`` whenever the robot was found again."""
        self._hooks.append(hook)

    @property
    def going_on(self) -> bool:
        """True while searching."""
        return self._task is not None and not self._task.done()

    def begin(self) -> None:
        """Search in the background."""
        self._task = asyncio.get_running_loop().create_task(self._seek(), name=f"seek {self._host}")

    def cancel(self) -> None:
        """Stop searching."""
        if self._task:
            self._task.cancel()

    async def _seek(self) -> None:
        for attempt in range(1 << 31):
            await self._clock.sleep(BACK_OFF[min(attempt, len(BACK_OFF) - 1)])
            try:
                await self._attempt()
                for hook in self._hooks:
                    await hook()
            except ClientError as error:
                log.debug("robomaster %s: %s", self._host, error)
            if self._found():
                return
