"""Frames of a WebSocket are read portion by portion, so that no flood of them stops the others."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

import pytest

from roboglot.clients.visual import TextLink
from roboglot.protocols import websocket
from roboglot.protocols.channels import Channel
from roboglot.protocols.websocket import PENDING_MAX, PORTION, WebSocketServer
from roboglot.testing.addresses import free_addresses

HOST = free_addresses(1)


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(60):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.005)


class Held:
    """A session whose messages wait until ``go_on`` is set."""

    def __init__(self) -> None:
        self.come: list[str | bytes] = []
        self.go_on = asyncio.Event()

    async def receive(self, message: str | bytes) -> None:
        self.come.append(message)
        await self.go_on.wait()

    def close(self) -> None:
        self.go_on.set()


async def test_short_messages_wait_as_long_ones_do() -> None:
    held = Held()
    async with listening(held) as (server, link):
        for number in range(3000):
            await link.send(str(number))
        await until(lambda: held.come)
        for _ in range(50):
            await asyncio.sleep(0)
        assert len(held.come) < PENDING_MAX + PORTION / 7
        held.go_on.set()
        await until(lambda: len(held.come) == 3000)
        assert held.come == [str(number) for number in range(3000)]
        assert server.connections


async def test_others_are_served_between_empty_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(websocket, "READ_SECONDS", 0.0)
    held = Held()
    async with listening(held) as (server, _):
        [connection] = server.connections
        empty = b"\x00\x80\0\0\0\0"
        connection.data_received(b"\x01\x80\0\0\0\0" + empty * 20_000 + b"\x80" + empty[1:])
        turns = 0
        while not held.come:
            await asyncio.sleep(0)
            turns += 1
        assert turns > 100
        assert held.come == [""]


@asynccontextmanager
async def listening(session: Held) -> AsyncIterator[tuple[WebSocketServer, TextLink]]:
    server = WebSocketServer({"/": Channel(lambda _: session)}, HOST, 0)
    await server.start()
    link = await TextLink.open(f"ws://{HOST}:{server.port}", "/")
    await until(lambda: server.connections)
    yield server, link
    await link.close()
    await server.close()
