"""The socket for the owner's commands: who gives way when there are too many callers."""

import asyncio
import contextlib
from pathlib import Path

from roboglot.hosting.local_socket import CALLERS_MAX, LocalServer


async def test_callers_being_answered_stay(tmp_path: Path) -> None:
    asked, go_on = asyncio.Semaphore(0), asyncio.Event()

    async def answer(line: bytes) -> bytes:
        asked.release()
        await go_on.wait()
        return line.strip()

    server = LocalServer(tmp_path / "s", "test", answer)
    await server.open()
    callers = [await asyncio.open_unix_connection(tmp_path / "s") for _ in range(CALLERS_MAX)]
    for _, writer in callers:
        writer.write(b"stop\n")
        await asked.acquire()
    reader, writer = await asyncio.open_unix_connection(tmp_path / "s")
    with contextlib.suppress(ConnectionError):
        assert await reader.read() == b""  # the newest is the only idle one
    go_on.set()
    for reader, _ in callers:
        assert await reader.readline() == b"stop\n"
    for _, ours in [*callers, (reader, writer)]:
        ours.close()
        with contextlib.suppress(ConnectionError):
            await ours.wait_closed()
    await server.close()
