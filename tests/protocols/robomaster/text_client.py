"""A tiny client of the text protocol that shares no code with ours, and the address of its robot."""

from __future__ import annotations

import asyncio
import socket

from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.testing.addresses import free_addresses

ADDRESS = free_addresses(1)
PATIENCE = 60  # real seconds


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
        """Return whether the robot closes the connection."""
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
        """Return all datagrams so far: text and the address it came from."""
        got = []
        while True:
            try:
                data, (host, _) = self.socket.recvfrom(2048)
            except BlockingIOError:
                return got
            got.append((data.decode(), host))

    def texts(self) -> list[str]:
        return [text for text, _ in self.drain()]


def port_of(door: RoboMasterDoor, name: str) -> int:
    return next(int(e.address.rpartition(":")[2]) for e in door.endpoints if e.label == f"RoboMaster {name}")
