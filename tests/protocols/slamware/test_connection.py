"""One HTTP connection, byte by byte: limits, garbage, slow clients, wishes for other protocols. No robot moves."""

import asyncio
import json
import logging

import httpx
import pytest

from roboglot.protocols.slamware import dispatch, http_connection
from roboglot.protocols.slamware.http_connection import HEAD_MAX
from roboglot.protocols.slamware.server import SlamwareDoor

ACTIONS = "/api/core/motion/v1/actions"
POIS = "/api/core/artifact/v1/pois"


async def raw(door: SlamwareDoor, data: bytes, *, wait: float = 60.0) -> bytes:
    """Send ``data``, say no more, read until the door closes."""
    reader, writer = await asyncio.open_connection("127.0.0.1", door.port)
    writer.write(data)
    try:
        async with asyncio.timeout(wait):
            return await reader.read()
    except ConnectionResetError:
        return b""
    finally:
        writer.close()


async def test_connection_close_is_obeyed(bare_door: SlamwareDoor) -> None:
    reply = await raw(bare_door, f"GET {POIS} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n".encode())
    assert reply.startswith(b"HTTP/1.1 200 OK")
    assert reply.endswith(b"\r\n\r\n[]")
    assert (await raw(bare_door, f"GET {POIS} HTTP/1.0\r\n\r\n".encode())).endswith(b"[]")


async def test_two_requests_in_one_packet(bare_door: SlamwareDoor) -> None:
    one = f"GET {POIS} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    last = f"GET {ACTIONS}/:current HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"
    reply = await raw(bare_door, (one + last).encode())
    assert reply.index(b"200 OK") < reply.index(b"404 Not Found")


@pytest.mark.parametrize("garbage", [b"\x16\x03\x01\x02\x00\x01" * 40, b"\0" * 100, b"hello\r\n\r\n", b"GET\r\n\r\n"])
async def test_garbage_is_dropped_and_no_one_notices(
    bare_door: SlamwareDoor, bare_client: httpx.AsyncClient, garbage: bytes
) -> None:
    assert (await raw(bare_door, garbage))[:12] in (b"", b"HTTP/1.1 400")
    assert (await bare_client.get(POIS)).status_code == 200


async def test_heads_are_bounded(bare_door: SlamwareDoor) -> None:
    endless = b"GET / HTTP/1.1\r\n" + b"x: " + b"y" * (2 * http_connection.HEAD_MAX)
    assert b" 431 " in await raw(bare_door, endless)


async def test_slow_clients_are_dropped(bare_door: SlamwareDoor, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http_connection, "REQUEST_SECONDS_MAX", 0.05)
    for begun in (b"", b"GET / HT", b"POST " + POIS.encode() + b" HTTP/1.1\r\nContent-Length: 9\r\n\r\n{"):
        assert await raw(bare_door, begun) == b""


async def test_long_body_may_arrive_slowly_but_steadily(
    bare_door: SlamwareDoor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(http_connection, "REQUEST_SECONDS_MAX", 1.0)
    monkeypatch.setattr(http_connection, "PIECE", 1000)
    reader, writer = await asyncio.open_connection("127.0.0.1", bare_door.port)
    path = b"/api/core/application/v1/apps"
    writer.write(b"POST " + path + b" HTTP/1.1\r\nConnection: close\r\nContent-Length: 5000\r\n\r\n")
    for _ in range(5):
        await asyncio.sleep(0.3)
        writer.write(b"x" * 1000)
    assert b"Failed to install application" in await asyncio.wait_for(reader.read(), 60.0)
    writer.close()


async def test_too_many_connections_are_dropped(bare_door: SlamwareDoor, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http_connection, "CONNECTIONS_MAX", 1)
    _, first = await asyncio.open_connection("127.0.0.1", bare_door.port)
    assert await raw(bare_door, f"GET {POIS} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode()) == b""
    first.close()


async def test_client_that_leaves_in_middle_does_no_harm(
    bare_door: SlamwareDoor, bare_client: httpx.AsyncClient
) -> None:
    _, writer = await asyncio.open_connection("127.0.0.1", bare_door.port)
    writer.write(f"POST {POIS} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100\r\n\r\n{{".encode())
    await writer.drain()
    writer.transport.abort()
    assert (await bare_client.get(POIS)).json() == []


@pytest.mark.parametrize(
    "head",
    [
        b"GET /" + b"x" * HEAD_MAX + b" HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nx: " + b"y" * HEAD_MAX + b"\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"xy: 0123456789\r\n" * (HEAD_MAX // 8) + b"\r\n",
    ],
)
async def test_long_head_in_one_piece_is_refused_too(bare_door: SlamwareDoor, head: bytes) -> None:
    assert (await raw(bare_door, head)).startswith(b"HTTP/1.1 431 ")


UPGRADES = [
    b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAA\r\n",
    b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AAMAAABkAAQAoAAAAAIAAAAA\r\n",
]


@pytest.mark.parametrize("upgrade", UPGRADES)
@pytest.mark.parametrize("pieces", [1, 3, 1000])
async def test_upgrade_request_gets_a_plain_answer(
    bare_door: SlamwareDoor,
    bare_client: httpx.AsyncClient,
    caplog: pytest.LogCaptureFixture,
    upgrade: bytes,
    pieces: int,
) -> None:
    body = json.dumps({"id": "a", "pose": {"x": 1, "y": 2}}).encode()
    data = b"POST %s HTTP/1.1\r\n%sContent-Length: %d\r\n\r\n%s" % (POIS.encode(), upgrade, len(body), body)
    data += b"GET %s HTTP/1.1\r\n%s\r\n" % (POIS.encode(), upgrade) * 2
    data += b"GET %s HTTP/1.1\r\nConnection: close\r\n\r\n" % POIS.encode()
    reader, writer = await asyncio.open_connection("127.0.0.1", bare_door.port)
    size = -(-len(data) // pieces)
    with caplog.at_level(logging.WARNING, "uvicorn"):
        for start in range(0, len(data), size):
            writer.write(data[start : start + size])
            await asyncio.sleep(0)
        answers = await asyncio.wait_for(reader.read(), 60.0)
    writer.close()
    assert answers.count(b"HTTP/1.1 200 OK") == answers.count(b"HTTP/1.1 ") == 4
    assert answers.count(b'"id":"a"') == 3
    assert not caplog.records


async def test_connect_requests_are_refused(bare_door: SlamwareDoor) -> None:
    assert (await raw(bare_door, b"CONNECT example.org:443 HTTP/1.1\r\nHost: example.org:443\r\n\r\n")).startswith(
        b"HTTP/1.1 400 "
    )


async def test_trailers_let_no_page_in(bare_door: SlamwareDoor) -> None:
    head = f"PUT {POIS}/x HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n"
    head += "Transfer-Encoding: chunked\r\nExpect: 100-continue\r\n"
    origin = "Origin: http://evil.example\r\n"
    reader, writer = await asyncio.open_connection("127.0.0.1", bare_door.port)
    try:
        writer.write(f"{head}\r\n".encode())
        assert await reader.readuntil(b"\r\n\r\n") == b"HTTP/1.1 100 Continue\r\n\r\n"  # the headers were looked at
        writer.write(f"2\r\n{{}}\r\n0\r\n{origin}\r\n".encode())
        assert b" 403 " not in await reader.readuntil(b"\r\n\r\n")
    finally:
        writer.close()
    assert b" 403 " in await raw(bare_door, f"{head}{origin}\r\n2\r\n{{}}\r\n0\r\n\r\n".encode())


async def test_trailer_in_one_piece_is_no_header(bare_door: SlamwareDoor) -> None:
    head = f"GET {POIS} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nTransfer-Encoding: chunked\r\n\r\n"
    trailed = f"{head}2\r\n{{}}\r\n0\r\nOrigin: http://evil.example\r\n\r\n"
    assert (await raw(bare_door, trailed.encode())).startswith(b"HTTP/1.1 200 ")


@pytest.mark.parametrize(
    ("garbage", "status"),
    [
        (b"hello\r\n\r\n", b"400"),
        (b"GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nno length\r\n", b"400"),
        (b"GET / HTTP/1.1\r\nx: " + b"y" * (2 * HEAD_MAX), b"431"),
    ],
)
@pytest.mark.parametrize("before", [0, 1, 3])
async def test_requests_before_garbage_are_answered_first(
    bare_door: SlamwareDoor, garbage: bytes, status: bytes, before: int
) -> None:
    answers = await raw(bare_door, f"GET {POIS} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode() * before + garbage)
    assert [answer[:3] for answer in answers.split(b"HTTP/1.1 ")[1:]] == [b"200"] * before + [status]


async def test_client_that_says_no_more_gets_its_answer(
    bare_door: SlamwareDoor, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard_all = asyncio.Event()
    monkeypatch.setattr(dispatch, "delay_response", lambda _robot: heard_all.wait())
    hear = http_connection.HttpConnection.eof_received

    def note_end(connection: http_connection.HttpConnection) -> bool:
        heard_all.set()
        return hear(connection)

    monkeypatch.setattr(http_connection.HttpConnection, "eof_received", note_end)
    reader, writer = await asyncio.open_connection("127.0.0.1", bare_door.port)
    writer.write(f"GET {POIS} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
    writer.write_eof()
    assert (await asyncio.wait_for(reader.read(), 60.0)).endswith(b"\r\n\r\n[]")
    writer.close()


@pytest.mark.parametrize(
    "begun", [b"", b"GET / HTTP", b"POST " + POIS.encode() + b" HTTP/1.1\r\nContent-Length: 9\r\n\r\n{"]
)
async def test_client_gone_within_its_request_is_let_go(bare_door: SlamwareDoor, begun: bytes) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", bare_door.port)
    writer.write(begun)
    writer.write_eof()
    assert await asyncio.wait_for(reader.read(), 60.0) == b""
    writer.close()
