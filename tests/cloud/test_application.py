"""The reference cloud as an ASGI application: how long it waits for a frame."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Mapping
from typing import Any

import pytest
from uvicorn.config import Config
from uvicorn.server import ServerState

from roboglot.cloud import application
from roboglot.cloud.application import BackEnd
from roboglot.storage.cloud import CloudStore
from roboglot.storage.database import Database
from roboglot.transport import http as http_connection
from roboglot.transport.http import HEAD_MAX, BoundedConnection
from roboglot.wire.visual.cloud import CloudCode, parse_answer


async def test_frame_that_never_ends_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(application, "BODY_SECONDS_MAX", 0.02)
    database = Database(":memory:")
    store = CloudStore(database)
    token = await store.add_account("school")
    pieces = iter([{"type": "http.request", "body": b"{", "more_body": True}])
    sent: list[Mapping[str, Any]] = []

    async def receive() -> Mapping[str, Any]:
        if (piece := next(pieces, None)) is None:
            await asyncio.Event().wait()
        return piece or {}

    async def send(event: Mapping[str, Any]) -> None:
        sent.append(event)

    headers = [(b"authorization", f"Bearer {token}".encode())]
    scope = {"type": "http", "path": "/programs", "method": "POST", "headers": headers}
    await asyncio.wait_for(BackEnd(store)(scope, receive, send), 10)
    assert sent[0]["status"] == 400
    assert parse_answer(sent[1]["body"]).code is CloudCode.TIMED_OUT
    database.close()


@pytest.fixture
async def port() -> AsyncIterator[int]:
    """Address of a listening cloud."""
    database = Database(":memory:")
    config = Config(BackEnd(CloudStore(database)), lifespan="off", log_level="critical")
    config.load()
    state = ServerState()
    server = await asyncio.get_running_loop().create_server(
        lambda: BoundedConnection(config=config, server_state=state, app_state={}), "127.0.0.1", 0
    )
    yield server.sockets[0].getsockname()[1]
    server.close()
    for connection in list(state.connections):
        connection.transport.abort()
    await asyncio.gather(*state.tasks)
    database.close()


async def answer(reader: asyncio.StreamReader) -> bytes:
    """Return the head of the next answer."""
    async with asyncio.timeout(PATIENCE):
        head = await reader.readuntil(b"\r\n\r\n")
        await reader.readexactly(int(head.lower().partition(b"content-length: ")[2].split()[0]))
        return head


PATIENCE = 60.0  # s of the machine's time
REQUEST = b"POST /programs HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 2\r\n\r\n{}"


@pytest.mark.parametrize(
    ("sent", "answers"),
    [
        (b"", 0),
        (b"POST /programs HTTP/1.1\r\nX: ", 0),
        (REQUEST + REQUEST + b"POST /programs HT", 2),
    ],
)
async def test_head_that_never_ends_is_not_waited_for(
    monkeypatch: pytest.MonkeyPatch, port: int, sent: bytes, answers: int
) -> None:
    monkeypatch.setattr(http_connection, "REQUEST_SECONDS_MAX", 0.2)
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(sent)
    answered = await asyncio.wait_for(reader.read(), PATIENCE)
    assert answered.count(b"HTTP/1.1 401") == answers
    writer.close()


async def test_blank_lines_do_not_keep_a_connection(monkeypatch: pytest.MonkeyPatch, port: int) -> None:
    """They end uvicorn's keep-alive timeout."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(REQUEST)
    await answer(reader)
    monkeypatch.setattr(http_connection, "REQUEST_SECONDS_MAX", 0.1)
    writer.write(b"\r\n")
    assert await asyncio.wait_for(reader.read(), PATIENCE) == b""
    writer.close()


async def test_a_head_without_end_is_not_kept(port: int) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(b"POST /programs HTTP/1.1\r\n")
    async with asyncio.timeout(PATIENCE):
        with contextlib.suppress(ConnectionError):
            for _ in range(HEAD_MAX // 1024 + 300):
                writer.write(b"x" * 1024)
                await writer.drain()
        with contextlib.suppress(ConnectionError):
            assert await reader.read() == b""
    writer.close()


async def test_a_large_head_in_one_piece_is_refused(port: int) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(REQUEST.replace(b"Host", b"X: " + b"x" * HEAD_MAX + b"\r\nHost"))
    answered = await asyncio.wait_for(reader.read(), PATIENCE)
    assert not answered or answered.startswith(b"HTTP/1.1 400 ")  # not, if it came in several pieces after all
    writer.close()


async def test_headers_after_a_body_are_bounded(port: int) -> None:
    """The parser hands over trailers as headers, and they were all kept: 200 MB for 12 MB."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    chunked = REQUEST.replace(b"Content-Length: 2", b"Transfer-Encoding: chunked").removesuffix(b"{}")
    assert chunked != REQUEST
    writer.write(chunked + b"2\r\n{}\r\n0\r\n" + HEAD_MAX // 4 * b"x:y\r\n")
    with contextlib.suppress(ConnectionError):
        answered = await asyncio.wait_for(reader.read(), PATIENCE)
        assert not answered or answered.startswith(b"HTTP/1.1 400 ")
    writer.close()


async def test_large_requests_one_behind_other_are_no_head(port: int) -> None:
    body = b" " * (2 * HEAD_MAX)
    request = REQUEST.replace(b"th: 2", b"th: %d" % len(body)).removesuffix(b"{}") + body
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(request * 3)
    for _ in range(3):
        assert b" 401 " in await answer(reader)
    writer.close()
