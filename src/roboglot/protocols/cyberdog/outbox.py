"""Outbox of messages of one code: a short queue that drops its oldest, and one sender. Knows no gRPC."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable


class Outbox:
    """Keeps the order of its messages; a slow or silent receiver delays nothing else."""

    def __init__(self, code: int, depth: int, send: Callable[[int, str], Awaitable[object]]) -> None:
        self.dropped = 0
        self._code = code
        self._send = send
        self._waiting: deque[str] = deque(maxlen=depth)
        self._wakeup = asyncio.Event()
        self._task = asyncio.get_running_loop().create_task(self._run(), name=f"push {code}")

    def put(self, text: str) -> None:
        """Queue ``text``; never waits."""
        self.dropped += len(self._waiting) == self._waiting.maxlen
        self._waiting.append(text)
        self._wakeup.set()

    def clear(self) -> None:
        """Drop the queue: its receiver is gone."""
        self._waiting.clear()

    async def close(self) -> None:
        """Stop the sender, even in the middle of a message."""
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self) -> None:
        while True:
            while self._waiting:
                await self._send(self._code, self._waiting.popleft())
            self._wakeup.clear()
            await self._wakeup.wait()
