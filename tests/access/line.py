"""A bad line between two ends of TCP: each packet is delayed, and a lost one holds up those behind it.

TCP repeats what is lost: it arrives RESENT later, and each repetition has the same chance of loss.
"""

from __future__ import annotations

import asyncio
import contextlib
import random
from collections.abc import AsyncIterator

PACKET = 1448  # bytes
RESENT = 1.25  # round trips until a lost packet is sent again (RACK: one, plus a quarter for reordering)
UNDERWAY_MAX = 4096  # packets


@contextlib.asynccontextmanager
async def bad_line(port: int, *, delay: float = 0.05, loss: float = 0.05, seed: int = 1) -> AsyncIterator[int]:  # noqa: C901
    """A port of this machine that leads to ``port`` of it, ``delay`` s each way."""
    chance = random.Random(seed)
    tasks: set[asyncio.Task[None]] = set()
    ends: set[asyncio.StreamWriter] = set()

    async def carry(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        far_reader, far_writer = await asyncio.open_connection("127.0.0.1", port)
        ends.update((writer, far_writer))
        for one, other in ((reader, far_writer), (far_reader, writer)):
            packets: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue(UNDERWAY_MAX)
            for work in (send(one, packets), arrive(packets, other)):
                task = asyncio.get_running_loop().create_task(work)
                tasks.add(task)
                task.add_done_callback(tasks.discard)

    async def send(reader: asyncio.StreamReader, packets: asyncio.Queue[tuple[float, bytes]]) -> None:
        loop = asyncio.get_running_loop()
        data = b"x"
        while data:
            try:
                data = await reader.read(PACKET)
            except ConnectionError:
                data = b""
            at = loop.time() + delay
            while chance.random() < loss:
                at += RESENT * 2 * delay
            await packets.put((at, data))

    async def arrive(packets: asyncio.Queue[tuple[float, bytes]], writer: asyncio.StreamWriter) -> None:
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

    server = await asyncio.start_server(carry, "127.0.0.1", 0)
    yield server.sockets[0].getsockname()[1]
    server.close()
    for task in tuple(tasks):
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    for end in ends:
        end.transport.abort()
        with contextlib.suppress(ConnectionError):
            await end.wait_closed()
