"""A TCP relay that does to a link what networks do: delay, silence, garbage, cuts, refusal."""

from __future__ import annotations

import asyncio
import contextlib

from roboglot.model.clock import Clock


class Proxy:
    """Between a client and ``target``; the attributes act at once on all connections."""

    def __init__(self, clock: Clock, target: tuple[str, int]) -> None:
        self._clock, self._target = clock, target
        self.delay = 0.0  # robot s, each way
        self.silent = False  # half-open: nothing passes, nobody is told
        self.garbage = b""  # said instead of the robot's next answers
        self.refusing = False
        self._server: asyncio.Server | None = None
        self._writers: set[asyncio.StreamWriter] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        self.passed = 0  # bytes towards the robot

    async def start(self) -> int:
        """Listen; the port."""
        self._server = await asyncio.start_server(self._accept, "127.0.0.1", 0)
        return int(self._server.sockets[0].getsockname()[1])

    def cut(self) -> None:
        """Break every connection."""
        for writer in tuple(self._writers):
            writer.transport.abort()

    async def close(self) -> None:
        """Stop."""
        self.cut()
        for task in tuple(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._server:
            self._server.close()

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self.refusing:
            writer.transport.abort()
            return
        try:
            far_reader, far_writer = await asyncio.open_connection(*self._target)
        except OSError:
            writer.transport.abort()
            return
        self._writers |= {writer, far_writer}
        for one, other, back in ((reader, far_writer, False), (far_reader, writer, True)):
            task = asyncio.ensure_future(self._relay(one, other, back=back))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _relay(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, back: bool) -> None:
        with contextlib.suppress(ConnectionError):
            while data := await reader.read(65536):
                if self.silent:
                    continue
                if self.delay:
                    await self._clock.sleep(self.delay)
                if back and self.garbage:
                    data = self.garbage
                if not back:
                    self.passed += len(data)
                writer.write(data)
        writer.transport.abort()
        self._writers.discard(writer)
