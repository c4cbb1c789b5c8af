"""Relay of TCP that delays each packet; a lost one holds up those behind it.

TCP repeats what is lost: it arrives RESENT later, and each repetition has the same chance of loss.
"""

from __future__ import annotations

import asyncio
import contextlib
import random
from collections.abc import AsyncIterator, Coroutine

PACKET = 1448  # bytes
RESENT = 1.25  # round trips until a lost packet is sent again (RACK: one, plus a quarter for reordering)
UNDERWAY_MAX = 4096  # packets

Packets = asyncio.Queue[tuple[float, bytes]]  # when each arrives, by the loop's time, s; an empty one is the last


@contextlib.asynccontextmanager
async def lossy_proxy(port: int, *, delay: float = 0.05, loss: float = 0.05, seed: int = 1) -> AsyncIterator[int]:
    """Yield a port of this machine that leads to ``port`` of it, ``delay`` s each way."""
    proxy = _Proxy(port, delay, loss, random.Random(seed))
    server = await asyncio.start_server(proxy.serve, "127.0.0.1", 0)
    yield server.sockets[0].getsockname()[1]
    server.close()
    await proxy.close()


class _Proxy:
    """All connections of one relay."""

    def __init__(self, port: int, delay: float, loss: float, dice: random.Random) -> None:
        self._port, self._delay, self._loss, self._dice = port, delay, loss, dice
        self._tasks: set[asyncio.Task[None]] = set()
        self._ends: set[asyncio.StreamWriter] = set()

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Relay one connection in both directions."""
        far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self._port)
        self._ends.update((writer, far_writer))
        for one, other in ((reader, far_writer), (far_reader, writer)):
            packets: Packets = asyncio.Queue(UNDERWAY_MAX)
            self._begin(self._send(one, packets))
            self._begin(_deliver(packets, other))

    async def close(self) -> None:
        """Cut all connections."""
        for task in tuple(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for end in self._ends:
            end.transport.abort()
            with contextlib.suppress(ConnectionError):
                await end.wait_closed()

    def _begin(self, work: Coroutine[None, None, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _send(self, reader: asyncio.StreamReader, packets: Packets) -> None:
        loop, data = asyncio.get_running_loop(), b"x"
        while data:
            try:
                data = await reader.read(PACKET)
            except ConnectionError:
                data = b""
            at = loop.time() + self._delay
            while self._dice.random() < self._loss:
                at += RESENT * 2 * self._delay
            await packets.put((at, data))


async def _deliver(packets: Packets, writer: asyncio.StreamWriter) -> None:
    loop = asyncio.get_running_loop()
    with contextlib.suppress(ConnectionError):
        while True:
            at, data = await packets.get()
            if (wait := at - loop.time()) > 0:
                await asyncio.sleep(wait)
            if not data:
                break
            writer.write(data)
            await writer.drain()
    writer.close()
