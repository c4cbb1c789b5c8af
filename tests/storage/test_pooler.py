"""A connection pooler before a PostgreSQL server, such as PgBouncer, keeps no promise of ours."""

from __future__ import annotations

import asyncio
import contextlib
import struct
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from roboglot.storage.opening import open_database
from roboglot.storage.postgresql_connection import POOLED
from roboglot.testing.addresses import free_addresses
from tests.storage.postgresql_server import PostgreSQLServer, needs_postgresql

ENCRYPTION = 80877103, 80877104  # requests for TLS and for GSSAPI
REFUSAL = "unsupported startup parameter: options"


class Pooler:
    """Passes clients on to a server without the settings they connect with, or refuses those, as PgBouncer does."""

    def __init__(self, socket: Path, *, ignores: bool) -> None:
        self._socket, self._ignores = socket, ignores
        self._tasks: set[asyncio.Task[None]] = set()
        self._writers: list[asyncio.StreamWriter] = []

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve one client."""
        self._writers.append(writer)
        with contextlib.suppress(asyncio.IncompleteReadError):  # it left
            await self._begin(reader, writer)

    async def close(self) -> None:
        """Close all connections, whose clients may have left without a word."""
        for writer in self._writers:
            writer.close()
        await asyncio.gather(*self._tasks)
        for writer in self._writers:
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    async def _begin(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while (opening := await self._opening(reader))[0] in ENCRYPTION:
            writer.write(b"N")
        version, words = opening
        values = dict(zip(words[::2], words[1::2], strict=False))
        if values.pop(b"options", b"") and not self._ignores:
            fields = b"SFATAL\0C08P01\0M" + REFUSAL.encode() + b"\0\0"
            writer.write(b"E" + struct.pack("!i", 4 + len(fields)) + fields)
            writer.close()
            return
        inside, to = await asyncio.open_unix_connection(self._socket)
        self._writers.append(to)
        packed = b"".join(part + b"\0" for pair in values.items() for part in pair) + b"\0"
        to.write(struct.pack("!ii", 8 + len(packed), version) + packed)
        self._tasks |= {asyncio.create_task(self._pass_on(*ends)) for ends in ((reader, to), (inside, writer))}

    async def _opening(self, reader: asyncio.StreamReader) -> tuple[int, list[bytes]]:
        length, version = struct.unpack("!ii", await reader.readexactly(8))
        return version, (await reader.readexactly(length - 8)).rstrip(b"\0").split(b"\0")

    async def _pass_on(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError):
            while data := await reader.read(65536):
                writer.write(data)
            writer.close()


@asynccontextmanager
async def pooled(server: PostgreSQLServer, *, ignores: bool) -> AsyncIterator[str]:
    """Yield the URL of a pooler before the server."""
    folder = server.url.partition("host=")[2].partition("&")[0]
    pooler = Pooler(Path(folder) / ".s.PGSQL.5432", ignores=ignores)
    listening = await asyncio.start_server(pooler.serve, free_addresses(1), 0)
    host, port = listening.sockets[0].getsockname()
    try:
        yield f"postgresql://robots@{host}:{port}/postgres"
    finally:
        listening.close()
        await pooler.close()


@needs_postgresql
@pytest.mark.parametrize("ignores", [True, False])
async def test_pooler_is_refused(db_server: PostgreSQLServer, tmp_path: Path, ignores: bool) -> None:
    """Behind one that shares connections, two programs held the lock of the same robot."""
    async with pooled(db_server, ignores=ignores) as url:
        with pytest.raises(OSError, match=POOLED):
            await asyncio.to_thread(open_database, tmp_path / "unused", url, ["a"])
