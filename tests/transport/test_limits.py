"""Buckets, and what they do to a connection."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

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
    assert sum(spent) == 200_000
    server.close()


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
