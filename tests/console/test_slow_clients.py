"""Clients that send too much, or too slowly, are not waited for; each costs little memory."""

from __future__ import annotations

import asyncio
import contextlib
from urllib.parse import urlsplit

import pytest

from roboglot.console import http as console_http
from roboglot.transport import http as connections
from tests.console.conftest import ServedConsole
from tests.console.test_studio_socket import page

PATIENCE = 60.0  # s of the machine's time
UPGRADE = (
    "GET {path} HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)


async def opened(served: ServedConsole) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    where = urlsplit(served.url)
    return await asyncio.open_connection(where.hostname, where.port)


async def test_head_without_end_is_not_kept(served: ServedConsole) -> None:
    reader, writer = await opened(served)
    writer.write(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
    async with asyncio.timeout(PATIENCE):
        with contextlib.suppress(ConnectionError):
            for number in range(connections.HEAD_MAX // 1000 + 300):
                writer.write(b"X-%d: %s\r\n" % (number, b"x" * 1000))
                await writer.drain()
        with contextlib.suppress(ConnectionError):
            assert await reader.read() == b""
    writer.close()


@pytest.mark.parametrize("head", [b"", b"GET /api/robots HTTP/1.1\r\nX: "])
async def test_slow_head_is_not_waited_for(served: ServedConsole, monkeypatch: pytest.MonkeyPatch, head: bytes) -> None:
    monkeypatch.setattr(connections, "REQUEST_SECONDS_MAX", 0.1)
    reader, writer = await opened(served)
    writer.write(head)
    async with asyncio.timeout(PATIENCE):
        assert await reader.read() == b""
    writer.close()


async def test_slow_body_is_refused(served: ServedConsole, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(console_http, "BODY_SECONDS_MAX", 0.1)
    reader, writer = await opened(served)
    writer.write(b"POST /api/robots/a/stop HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100\r\n\r\n{")
    async with asyncio.timeout(PATIENCE):
        assert b" 408 " in await reader.readline()
    writer.close()


@pytest.mark.parametrize("frame", [b"\x00\x80\0\0\0\0", b"\x89\x80\0\0\0\0", b"\x8a\x80\0\0\0\0"])
@pytest.mark.parametrize("path", ["/live", "/studio"])
async def test_empty_frames_without_end_are_refused(served: ServedConsole, path: str, frame: bytes) -> None:
    """Pieces of a message, pings, pongs."""
    reader, writer = await opened(served)
    writer.write(UPGRADE.format(path=path, host=served.url.partition("//")[2]).encode())
    assert b" 101 " in await reader.readuntil(b"\r\n\r\n")
    writer.write(b"\x01\x80\0\0\0\0" + frame * 10_000)
    last = b""
    async with asyncio.timeout(PATIENCE):
        with contextlib.suppress(ConnectionError):
            while piece := await reader.read(65536):
                last = piece
    assert b"keepalive" not in last  # it was not the silence that ended it
    writer.transport.abort()
    async with page(served):  # others are served
        pass
