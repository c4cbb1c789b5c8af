"""One host's open calls leave room for other hosts: without a request, and without a reader of their answers."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, nullcontext

import grpc
import pytest
from grpc._cython import cygrpc

from roboglot.testing.addresses import free_addresses
from roboglot.transport import host_calls
from roboglot.transport.host_calls import HostCalls
from roboglot.transport.last_messages import ending_with_last

ADDRESS = free_addresses(1)
MOST, ALL = 3, 5  # open calls: of a host, and of all
PATIENCE = 20.0  # s
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
DATA, HEADERS, SETTINGS = 0, 1, 4  # kinds of frames
END_STREAM, END_HEADERS = 1, 4
HEADER_FIELDS = {
    ":method": "POST",
    ":scheme": "http",
    ":path": "/words/ask",
    ":authority": "words",
    "content-type": "application/grpc",
    "te": "trailers",
}
NO_WINDOW = b"\0\4" + bytes(4)  # a client that takes no bytes of answers


async def _answers(request: bytes, _: grpc.aio.ServicerContext) -> bytes:
    return request


@asynccontextmanager
async def _served() -> AsyncIterator[int]:
    """The port of a server at which each connection is a host."""
    handler = HostCalls(lambda peer: peer, MOST).limiting(ending_with_last(_answers, bytes, nullcontext))
    server = grpc.aio.server(maximum_concurrent_rpcs=ALL)
    methods = {"ask": grpc.unary_stream_rpc_method_handler(handler)}
    server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler("words", methods),))
    port = server.add_insecure_port(f"{ADDRESS}:0")
    await server.start()
    yield port
    await server.stop(None)


def _frame(kind: int, flags: int, stream: int, body: bytes) -> bytes:
    return len(body).to_bytes(3, "big") + bytes([kind, flags]) + stream.to_bytes(4, "big") + body


def _calls(number: int, *, whole: bool) -> bytes:
    """Calls with their requests, or without."""
    block = b"".join(
        b"\0" + bytes([len(name)]) + name.encode() + bytes([len(value)]) + value.encode()
        for name, value in HEADER_FIELDS.items()
    )
    sent = PREFACE + _frame(SETTINGS, 0, 0, NO_WINDOW)
    for stream in range(1, 2 * number, 2):
        sent += _frame(HEADERS, END_HEADERS, stream, block)
        if whole:
            sent += _frame(DATA, END_STREAM, stream, bytes(4) + b"\3one")
    return sent


async def _ask(port: int) -> list[bytes]:
    async with grpc.aio.insecure_channel(f"{ADDRESS}:{port}") as channel:
        return [word async for word in channel.unary_stream("/words/ask")(b"one")]


@pytest.mark.parametrize("whole", [True, False], ids=["without a reader", "without a request"])
async def test_open_calls_of_a_host_leave_room(whole: bool) -> None:
    async with asyncio.timeout(PATIENCE), _served() as port:
        hostile, writer = await asyncio.open_connection(ADDRESS, port)
        writer.write(_calls(2 * ALL, whole=whole))
        await hostile.readuntil(b"grpc-message")  # one is refused
        assert await _ask(port) == [b"one"]
        writer.close()


async def test_ended_calls_of_a_host_leave_room() -> None:
    async with asyncio.timeout(PATIENCE), _served() as port, grpc.aio.insecure_channel(f"{ADDRESS}:{port}") as channel:
        for _ in range(2 * ALL):
            assert [word async for word in channel.unary_stream("/words/ask")(b"one")] == [b"one"]


def test_this_grpc_counts_whole_calls() -> None:
    HostCalls(lambda peer: peer, MOST).limiting(_answers)
    assert getattr(cygrpc, host_calls._CALL) is host_calls._counted
