"""The event port: a read-only connection, which reconnects by itself until it is closed."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

from roboglot.clients.robomaster.control import CONNECT_SECONDS_MAX, keep_asking
from roboglot.model.clock import Clock
from roboglot.wire.robomaster.lines import LineSplitter

RETRY_SECONDS = 1.0
READ_MAX = 65536  # bytes at a time


class EventLink:
    """Calls ``heard`` with each event's text, as the bytes of one line."""

    def __init__(self, clock: Clock, port: int, heard: Callable[[bytes], None]) -> None:
        self._clock, self._port, self._heard = clock, port, heard
        self._task: asyncio.Task[None] | None = None
        self._connected = asyncio.Event()

    async def open(self, host: str) -> None:
        """Listen to the robot at ``host``; returns when that is connected, or soon if the robot has no such port."""
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._run(host), name=f"events of {host}")
        with contextlib.suppress(TimeoutError):
            await self._clock.wait_for(self._connected.wait(), RETRY_SECONDS / 2)

    def close(self) -> None:
        """Disconnect for good."""
        if self._task:
            self._task.cancel()
            self._task = None
        self._connected.clear()

    async def _run(self, host: str) -> None:
        while True:
            with contextlib.suppress(OSError, TimeoutError):
                await self._listen(host)
            await self._clock.sleep(RETRY_SECONDS)

    async def _listen(self, host: str) -> None:
        opening = asyncio.open_connection(host, self._port)
        reader, writer = await self._clock.wait_for(opening, CONNECT_SECONDS_MAX)
        keep_asking(writer.get_extra_info("socket"))
        self._connected.set()
        splitter = LineSplitter()
        try:
            while data := await reader.read(READ_MAX):
                for text in splitter.feed(data):
                    if text is not None:
                        self._heard(text.encode())
        finally:
            writer.transport.abort()
