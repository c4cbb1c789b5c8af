"""Test that gRPC's wake-ups of the loop are read as fast as they come."""

from __future__ import annotations

import asyncio
import socket
import threading

import grpc
import pytest

from roboglot.testing.addresses import free_addresses
from roboglot.transport import wakes
from roboglot.transport.wakes import prompt_wakes

ADDRESS = free_addresses(1)


async def test_all_bytes_are_read_in_one_turn() -> None:
    loop, left, woken = asyncio.get_running_loop(), list[int](), asyncio.Event()
    reads, writes = socket.socketpair()
    reads.setblocking(False)

    def wake() -> None:
        left.append(len(reads.recv(1000)))
        woken.set()

    with reads, writes:
        with prompt_wakes():
            loop.add_reader(reads, wake)
        writes.send(bytes(200))
        await woken.wait()
        await asyncio.sleep(0)
        loop.remove_reader(reads)
    assert left == [1]  # and gRPC reads one byte a turn


async def test_server_made_within_wakes_so(monkeypatch: pytest.MonkeyPatch) -> None:
    loop, takes, read_ahead = asyncio.get_running_loop(), list[socket.socket](), wakes._read_ahead
    own = loop.add_reader

    def noted(reads: socket.socket) -> None:
        takes.append(reads)
        read_ahead(reads)

    monkeypatch.setattr(wakes, "_read_ahead", noted)
    with prompt_wakes():
        server = grpc.aio.server()
    assert loop.add_reader == own
    port = server.add_insecure_port(f"{ADDRESS}:0")
    await server.start()
    async with grpc.aio.insecure_channel(f"{ADDRESS}:{port}") as channel:
        with pytest.raises(grpc.aio.AioRpcError, match="UNIMPLEMENTED"):
            await channel.unary_unary("/nothing/there")(b"")
    await server.stop(None)
    assert takes


def test_loops_of_two_threads_take_turns() -> None:
    reads, writes = socket.socketpair()
    left, others = list[int](), list[int]()

    def wake() -> None:
        other = threading.Thread(target=wakes._taker(reads, lambda: others.append(len(reads.recv(1)))))
        other.start()
        other.join()
        left.append(len(reads.recv(1)))

    with reads, writes:
        reads.setblocking(False)
        writes.send(bytes(5))
        wakes._taker(reads, wake)()
        assert (left, others) == ([1], [])
        writes.send(bytes(1))
        wakes._taker(reads, lambda: left.append(len(reads.recv(1))))()
    assert left == [1, 1]


def test_bytes_left_are_read_within_a_few_turns() -> None:
    reads, writes = socket.socketpair()
    left = list[int]()
    with reads, writes:
        reads.setblocking(False)
        take = wakes._taker(reads, lambda: left.append(len(reads.recv(1))))
        for _ in range(3 * wakes.LOOKED_FOR):
            writes.send(bytes(5))
            take()
        assert len(reads.recv(1000)) < 5 * wakes.LOOKED_FOR
        take()  # another loop has read all: no error, and no event to take
    assert left == [1] * 3 * wakes.LOOKED_FOR
