"""Buckets, and what they do to a connection."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.transport import metered
from roboglot.transport.limiter import BUCKETS_MAX, Limiter
from roboglot.transport.log_limiter import KINDS_MAX, LogLimiter
from roboglot.transport.metered import Metered
from tests.transport.test_tls import Echo


@given(st.lists(st.tuples(st.floats(0.0, 2.0), st.integers(1, 50)), min_size=1, max_size=50))
def test_never_more_than_burst_and_rate_pass(steps: list[tuple[float, int]]) -> None:
    now = 0.0
    limiter = Limiter(10.0, 20.0, lambda: now)
    passed = 0
    for wait, asked in steps:
        now += wait
        passed += sum(limiter.take("x") for _ in range(asked))
        assert passed <= 20.0 + 10.0 * now + 1e-6


@given(st.lists(st.integers(1, 1000), min_size=1, max_size=50))
def test_a_debt_is_paid_with_time(amounts: list[int]) -> None:
    now = 0.0
    limiter = Limiter(100.0, 50.0, lambda: now)
    for amount in amounts:
        now += limiter.spend("x", amount)
    assert sum(amounts) <= 50.0 + 100.0 * now + 1e-6


@pytest.mark.slow  # a load test
def test_many_clients_take_bounded_memory() -> None:
    limiter = Limiter(1.0, 5.0, time.monotonic)
    for number in range(3 * BUCKETS_MAX):
        limiter.take(f"client {number}")
    assert len(limiter._buckets) <= BUCKETS_MAX


def test_a_take_can_be_given_back() -> None:
    limiter = Limiter(1.0, 1.0, lambda: 0.0)
    assert limiter.take("x")
    assert not limiter.take("x")
    limiter.give_back("x")
    assert limiter.take("x")


async def test_client_that_sends_too_much_is_read_later() -> None:
    spent: list[int] = []

    def spend(amount: int) -> float:
        spent.append(amount)
        return 0.05 if sum(spent) < 200_000 else 0.0  # half of it outgoing, half incoming

    loop = asyncio.get_running_loop()
    ended = asyncio.Event()
    server = await loop.create_server(lambda: Metered(Echo(), spend, ended.set), "127.0.0.1", 0)
    reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
    writer.write(bytes(100_000))
    async with asyncio.timeout(60.0):
        assert len(await reader.readexactly(100_000)) == 100_000
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()
        await ended.wait()
    assert 200_000 - metered.STEP < sum(spent) <= 200_000
    server.close()


class Socket(asyncio.Transport):
    """Records whether it is read from."""

    def __init__(self) -> None:
        super().__init__()
        self.reads, self.closed = True, False

    def pause_reading(self) -> None:
        self.reads = False

    def resume_reading(self) -> None:
        self.reads = True

    def is_closing(self) -> bool:
        return self.closed

    def close(self) -> None:
        self.closed = True


class Slow(asyncio.Protocol):
    """Takes half a turn for each slice; ``pauses``: before this slice it asks for a pause."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, pauses: int = 0) -> None:
        self.now, self.got, self.slices, self.ended, self.pauses = 0.0, bytearray(), 0, False, pauses
        monkeypatch.setattr(metered, "perf_counter", lambda: self.now)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)

    def data_received(self, data: bytes) -> None:
        self.got += data
        self.slices += 1
        self.now += metered.TURN / 2
        if self.slices == self.pauses:
            self.transport.pause_reading()

    def eof_received(self) -> bool:
        self.ended = True
        return False


def connected(slow: Slow) -> tuple[Metered, Socket]:
    meter, socket = Metered(slow, lambda _: 0.0, lambda: None), Socket()
    meter.connection_made(socket)
    return meter, socket


async def test_other_connections_are_served_in_between(monkeypatch: pytest.MonkeyPatch) -> None:
    """A loop hands over 8 MB at once: 1.4 million empty WebSocket frames, which took 8 s."""
    slow = Slow(monkeypatch)
    meter, socket = connected(slow)
    data = bytes(range(256)) * 176  # 11 slices
    meter.data_received(data)
    meter.data_received(b"the end")
    assert meter.eof_received()  # waits for the rest
    turns = [slow.slices]
    while not socket.closed:
        assert not socket.reads
        assert not slow.ended
        await asyncio.sleep(0)
        turns.append(slow.slices)
    assert turns == [2, 4, 6, 8, 10, 12]
    assert slow.got == data + b"the end"
    assert slow.ended


async def test_rest_waits_while_the_protocol_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    slow = Slow(monkeypatch, pauses=3)
    meter, socket = connected(slow)
    meter.data_received(bytes(5 * metered.SLICE))
    for _ in range(5):
        await asyncio.sleep(0)
    assert (slow.slices, socket.reads) == (3, False)
    slow.transport.resume_reading()
    assert not socket.reads
    await asyncio.sleep(0)
    assert (slow.slices, socket.reads) == (5, True)


async def test_closed_connection_passes_nothing_on(monkeypatch: pytest.MonkeyPatch) -> None:
    slow = Slow(monkeypatch)
    meter, socket = connected(slow)
    meter.data_received(bytes(5 * metered.SLICE))
    socket.close()
    await asyncio.sleep(0)
    assert slow.slices == 2
    meter.connection_lost(None)
    await asyncio.sleep(0)
    assert slow.slices == 2


def test_the_log_is_not_flooded(caplog: pytest.LogCaptureFixture) -> None:
    seldom = LogLimiter(logging.getLogger("test"))
    with caplog.at_level(logging.WARNING):
        for number in range(100):
            seldom.warning("10.0.0.7", "refused %d", number)
        seldom.warning("10.0.0.8", "refused")
        assert len(caplog.records) == 2
        for number in range(2 * KINDS_MAX):
            seldom.warning(f"host {number}", "refused")
    assert len(seldom._said) <= KINDS_MAX
