"""Test that gRPC's wake-ups of the loop are read as fast as they come."""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
from typing import Any

import grpc
import pytest

from roboglot.testing.addresses import free_addresses
from roboglot.transport import grpc_wakeups
from roboglot.transport.grpc_wakeups import prompt_wakeups

ADDRESS = free_addresses(1)
PATIENCE = 60.0  # real s


def read_one(reads: socket.socket) -> None:
    """Stand in for gRPC, which reads one byte and takes all events."""
    assert reads.recv(1)


def held(reads: socket.socket) -> int:
    """Return the number of bytes in the socket."""
    try:
        return len(reads.recv(1000, socket.MSG_PEEK))
    except BlockingIOError:
        return 0


async def test_all_bytes_are_read_in_one_turn() -> None:
    loop, turns, woken = asyncio.get_running_loop(), list[int](), asyncio.Event()
    reads, writes = socket.socketpair()
    reads.setblocking(False)

    def wake() -> None:
        read_one(reads)
        turns.append(1)
        woken.set()

    with reads, writes:
        with prompt_wakeups():
            loop.add_reader(reads, wake)
        writes.send(bytes(200))
        await woken.wait()
        await asyncio.sleep(0)
        loop.remove_reader(reads)
        assert held(reads) == 0
    assert turns == [1]


async def test_server_made_within_wakes_so(monkeypatch: pytest.MonkeyPatch) -> None:
    loop, takes, count = asyncio.get_running_loop(), list[socket.socket](), grpc_wakeups._count
    own = loop.add_reader

    def noted(reads: socket.socket) -> int:
        takes.append(reads)
        return count(reads)

    monkeypatch.setattr(grpc_wakeups, "_count", noted)
    with prompt_wakeups():
        server = grpc.aio.server()
    assert loop.add_reader == own
    port = server.add_insecure_port(f"{ADDRESS}:0")
    await server.start()
    async with grpc.aio.insecure_channel(f"{ADDRESS}:{port}") as channel, asyncio.timeout(PATIENCE):
        while not takes:  # a loop of another thread, left by an earlier test, may take a call's events
            with pytest.raises(grpc.aio.AioRpcError, match="UNIMPLEMENTED"):
                await channel.unary_unary("/nothing/there")(b"")
    await server.stop(None)


def test_loops_of_two_threads_take_turns() -> None:
    reads, writes = socket.socketpair()
    turns = list[str]()

    def wake() -> None:
        other = threading.Thread(target=grpc_wakeups._taker(reads, lambda: turns.append("other")))
        other.start()
        other.join()
        turns.append("own")
        read_one(reads)

    with reads, writes:
        reads.setblocking(False)
        writes.send(bytes(5))
        grpc_wakeups._taker(reads, wake)()
        assert turns == ["own"]
        assert held(reads) == 0
        writes.send(bytes(1))
        grpc_wakeups._taker(reads, lambda: read_one(reads))()
        assert held(reads) == 0


def test_bytes_left_are_read_within_a_few_turns() -> None:
    reads, writes = socket.socketpair()
    with reads, writes:
        reads.setblocking(False)
        take = grpc_wakeups._taker(reads, lambda: read_one(reads))
        for _ in range(3 * grpc_wakeups.LOOKED_FOR):
            writes.send(bytes(5))
            take()
        assert held(reads) < 5 * grpc_wakeups.LOOKED_FOR
        reads.recv(1000)
        take()  # another loop has read all: no error, and no event to take


def test_events_behind_a_closed_loops_are_taken() -> None:
    """gRPC raises at it, and reads no further."""
    reads, writes = socket.socketpair()
    gone, events = asyncio.new_event_loop(), ["gone", "own", "gone", "own"]
    gone.close()
    taken = list[str]()

    def wake() -> None:
        read_one(reads)
        while events:
            if (event := events.pop(0)) == "gone":
                gone.call_soon_threadsafe(taken.append, event)
            taken.append(event)

    with reads, writes:
        reads.setblocking(False)
        writes.send(bytes(len(events)))
        take = grpc_wakeups._taker(reads, wake)
        while held(reads):
            take()
        assert taken == ["own", "own"]
        with pytest.raises(RuntimeError, match="of ours"):
            grpc_wakeups._taker(reads, lambda: _fail("of ours"))()


def _fail(words: str) -> None:
    raise RuntimeError(words)


def test_calls_of_a_closed_loop_disturb_no_other(caplog: pytest.LogCaptureFixture) -> None:
    """A call ends when its loop is gone: the next loop takes gRPC's event."""
    with socket.create_server((ADDRESS, 0)) as silent:
        where = f"{ADDRESS}:{silent.getsockname()[1]}"
        gone = asyncio.new_event_loop()
        left = gone.run_until_complete(_begin_call(where))
        gone.close()

        async def end() -> grpc.StatusCode:
            own = await _begin_call(where)
            silent.close()
            async with asyncio.timeout(PATIENCE):
                return await own.code()

        assert asyncio.run(end()) is grpc.StatusCode.UNAVAILABLE
    assert left
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


async def _begin_call(where: str) -> Any:
    with prompt_wakeups():
        channel = grpc.aio.insecure_channel(where, options=(("grpc.use_local_subchannel_pool", 1),))
    call = channel.unary_unary("/nothing/there")(b"")
    await asyncio.sleep(0)  # it begins
    return call
