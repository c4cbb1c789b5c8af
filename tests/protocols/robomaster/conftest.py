"""A door on free ports of a loopback address, and a tiny client that shares no code with ours."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator

import pytest

from roboglot.model.robot import Robot
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from tests.protocols.robomaster.text_client import ADDRESS, Inbox, TextClient, port_of


@pytest.fixture
def inbox_at() -> Iterator[Callable[[str, int], Inbox]]:
    """Maker of further clients, at a host and port."""
    opened: list[Inbox] = []

    def open_one(host: str, port: int) -> Inbox:
        opened.append(Inbox(host, port))
        return opened[-1]

    yield open_one
    for inbox in opened:
        inbox.socket.close()


@pytest.fixture
def pushes() -> Iterator[Inbox]:
    """Yield the client's inbox for pushes."""
    inbox = Inbox("127.0.0.1")
    yield inbox
    inbox.socket.close()


@pytest.fixture
def broadcasts() -> Iterator[Inbox]:
    """Yield an inbox for robots' broadcasts."""
    inbox = Inbox("")
    yield inbox
    inbox.socket.close()


@pytest.fixture
async def door(request, robot: Robot, pushes: Inbox, broadcasts: Inbox) -> AsyncIterator[RoboMasterDoor]:
    opened = RoboMasterDoor(
        robot,
        ADDRESS,
        RoboMasterConfig(
            control_port=0,
            event_port=0,
            video_port=0,
            audio_port=0,
            explanation_port=0,
            push_port=pushes.port,
            broadcast_port=broadcasts.port,
            **getattr(request, "param", {}),
        ),
    )
    await opened.start()
    yield opened
    await opened.close()  # the fleet waits until the robot stands


Connect = Callable[..., Awaitable[TextClient]]


@pytest.fixture
async def connect(door: RoboMasterDoor) -> AsyncIterator[Connect]:
    """Opens control connections, from 127.0.0.1 unless given, with a receive buffer of some bytes unless 0."""
    clients: list[TextClient] = []

    async def open_one(host: str = "127.0.0.1", buffer: int = 0) -> TextClient:
        made = socket.socket()
        if buffer:  # before it connects: once open, a kernel may drop what no longer fits, acknowledgements included
            made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
        made.setblocking(False)
        made.bind((host, 0))
        await asyncio.get_running_loop().sock_connect(made, (ADDRESS, port_of(door, "text SDK")))
        streams = await asyncio.open_connection(sock=made)
        clients.append(TextClient(*streams))
        return clients[-1]

    yield open_one
    for client in clients:
        client.writer.transport.abort()
    await asyncio.sleep(0.01)


@pytest.fixture
async def event_port(door: RoboMasterDoor) -> int:
    return port_of(door, "events")


Listen = Callable[[str], Awaitable[asyncio.StreamReader]]


@pytest.fixture
async def listen(door: RoboMasterDoor) -> AsyncIterator[Listen]:
    """Opens a connection to one of the ports that only send: events, video, audio, explanations."""
    writers: list[asyncio.StreamWriter] = []

    async def open_one(name: str) -> asyncio.StreamReader:
        reader, writer = await asyncio.open_connection(ADDRESS, port_of(door, name))
        writers.append(writer)
        await asyncio.sleep(0.02)  # until the door has noticed it
        return reader

    yield open_one
    for writer in writers:
        writer.transport.abort()
    await asyncio.sleep(0.01)


@pytest.fixture
async def client(connect: Connect) -> TextClient:
    """A client in SDK mode."""
    opened = await connect()
    assert await opened.ask("command;") == "ok;"
    return opened
