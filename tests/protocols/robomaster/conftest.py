"""A door on free ports of a loopback address, and a tiny client of its own that knows nothing of ours."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator

import pytest

from roboglot.config import RoboMasterConfig
from roboglot.model.robot import Robot
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.testing import Forward

ADDRESS = "127.0.0.9"
PATIENCE = 5  # real seconds


class TextClient:
    """Sends text, reads up to the next ``;``."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer

    def send(self, text: str | bytes) -> None:
        self.writer.write(text.encode() if isinstance(text, str) else text)

    async def reply(self) -> str:
        async with asyncio.timeout(PATIENCE):
            return (await self.reader.readuntil(b";")).decode()

    async def ask(self, text: str) -> str:
        self.send(text)
        return await self.reply()

    async def numbers(self, text: str) -> list[float]:
        return [float(word) for word in (await self.ask(text)).rstrip(";").split()]

    async def ended(self) -> bool:
        """Whether the robot closes the connection."""
        async with asyncio.timeout(PATIENCE):
            try:
                return await self.reader.read(1) == b""
            except ConnectionError:
                return True

    async def close(self) -> None:
        """Returns when the robot has noticed."""
        self.writer.close()
        for _ in range(20):
            await asyncio.sleep(0)
        await asyncio.sleep(0.02)


class Inbox:
    """A UDP socket that keeps what comes."""

    def __init__(self, host: str, port: int = 0) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self.socket.bind((host, port))
        self.socket.setblocking(False)
        self.port: int = self.socket.getsockname()[1]

    def drain(self) -> list[tuple[str, str]]:
        """All datagrams so far: text and the address it came from."""
        got = []
        while True:
            try:
                data, (host, _) = self.socket.recvfrom(2048)
            except BlockingIOError:
                return got
            got.append((data.decode(), host))

    def texts(self) -> list[str]:
        return [text for text, _ in self.drain()]


@pytest.fixture
def inbox_at() -> Iterator[Callable[[str, int], Inbox]]:
    """More of them, at a host and port."""
    opened: list[Inbox] = []

    def open_one(host: str, port: int) -> Inbox:
        opened.append(Inbox(host, port))
        return opened[-1]

    yield open_one
    for inbox in opened:
        inbox.socket.close()


@pytest.fixture
def pushes() -> Iterator[Inbox]:
    """Where the client listens for pushes."""
    inbox = Inbox("127.0.0.1")
    yield inbox
    inbox.socket.close()


@pytest.fixture
def broadcasts() -> Iterator[Inbox]:
    """Where somebody listens for robots on the network."""
    inbox = Inbox("")
    yield inbox
    inbox.socket.close()


@pytest.fixture
async def door(
    request, robot: Robot, forward: Forward, pushes: Inbox, broadcasts: Inbox
) -> AsyncIterator[RoboMasterDoor]:
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
    await opened.close()
    for action in robot.actions.running():
        action.cancel()
    await forward(seconds=1)  # braking takes robot time, and nobody else lets any pass


def port_of(door: RoboMasterDoor, name: str) -> int:
    return next(int(e.address.rpartition(":")[2]) for e in door.endpoints if e.label == f"RoboMaster {name}")


Connect = Callable[..., Awaitable[TextClient]]


@pytest.fixture
async def connect(door: RoboMasterDoor) -> AsyncIterator[Connect]:
    """Opens control connections, from 127.0.0.1 unless told."""
    clients: list[TextClient] = []

    async def open_one(host: str = "127.0.0.1") -> TextClient:
        streams = await asyncio.open_connection(ADDRESS, port_of(door, "text SDK"), local_addr=(host, 0))
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
        await asyncio.sleep(0.02)  # until the door has seen it
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
