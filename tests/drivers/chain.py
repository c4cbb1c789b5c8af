"""What the tests of drivers talk with: a tiny text client, and types of fixtures."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from roboglot.clients.slamware import SlamwareClient
from roboglot.model.robot import Robot
from roboglot.testing import Forward

PATIENCE = 5  # real seconds


class TextClient:
    """A RoboMaster script, as far as it goes: sends text, reads up to the next ``;``."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer

    async def ask(self, text: str) -> str:
        self.writer.write(text.encode())
        async with asyncio.timeout(PATIENCE):
            return (await self.reader.readuntil(b";")).decode().rstrip(";")

    async def numbers(self, text: str) -> list[float]:
        return [float(word) for word in (await self.ask(text)).split()]


Drive = Callable[[str], Awaitable[Robot]]
OpenRest = Callable[[Robot], Awaitable[SlamwareClient]]
Open = Callable[[Robot], Awaitable[TextClient]]


@dataclass
class Script:
    """A text client connected to a door in front of a driver."""

    client: TextClient
    forward: Forward

    async def done(self, text: str, patience: float = 40.0) -> str:
        """Send a command whose answer takes robot time."""
        asked = asyncio.ensure_future(self.client.ask(text))
        for _ in range(int(patience / 0.25)):
            await self.forward(seconds=0.25)
            await asyncio.sleep(0)
            if asked.done():
                break
        return await asked
