"""Clients in front of a driven robot: a small text client, and the types of the fixtures that make clients."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from roboglot.clients.slamware import SlamwareClient
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.testing import Forward
from roboglot.testing.addresses import free_addresses, free_port

PATIENCE = 60  # real seconds, on a busy machine
EP_ADDRESS = free_addresses(1)


class TextClient:
    """Client of the text protocol: sends text, reads up to the next ``;``."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, patience: float = PATIENCE) -> None:
        self.reader, self.writer, self.patience = reader, writer, patience

    async def ask(self, text: str) -> str:
        self.writer.write(text.encode())
        async with asyncio.timeout(self.patience):
            return (await self.reader.readuntil(b";")).decode().rstrip(";")

    async def numbers(self, text: str) -> list[float]:
        return [float(word) for word in (await self.ask(text)).split()]


Drive = Callable[[str], Awaitable[Robot]]
OpenRest = Callable[[Robot], Awaitable[SlamwareClient]]
Open = Callable[[Robot], Awaitable[TextClient]]
Until = Callable[..., Awaitable[None]]


@dataclass
class Script:
    """A text client connected to a door in front of a driver."""

    client: TextClient
    forward: Forward

    async def done(self, text: str, patience: float = 40.0) -> str:
        """Return the answer to a command, which takes robot time."""
        asked = asyncio.ensure_future(self.client.ask(text))
        for _ in range(int(patience / 0.25)):
            await self.forward(seconds=0.25)
            await asyncio.sleep(0)
            if asked.done():
                break
        return await asked


def ep_config() -> RoboMasterConfig:
    """Return a configuration with free ports."""
    return RoboMasterConfig(
        control_port=0,
        event_port=0,
        video_port=0,
        audio_port=0,
        push_port=free_port(),
        broadcast_port=free_port(),
    )


@asynccontextmanager
async def served(vendor: str, robot: Robot, folder: Path) -> AsyncIterator[str]:
    """Put a vendor's door in front of a robot; yield the door's URL, as the command line takes it."""
    door: SlamwareDoor | RoboMasterDoor | CyberDogDoor
    match vendor:
        case "slamware":
            door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
        case "robomaster":
            door = RoboMasterDoor(robot, EP_ADDRESS, ep_config())
        case _:
            door = CyberDogDoor(robot, "127.0.0.1", CyberDogConfig(port=0, app_port=free_port()), folder / "back")
            export_client(folder / "back" / "cyberdog", folder / "driver")
    await door.start()
    try:
        match door:
            case RoboMasterDoor():
                yield url_of(door)
            case SlamwareDoor():
                yield f"slamware://127.0.0.1:{door.port}"
            case _:
                yield f"cyberdog://127.0.0.1:{door.port}?certs={folder / 'driver'}&app={door._config.app_port}"
    finally:
        await door.close()


def url_of(door: RoboMasterDoor) -> str:
    """Return the door's URL, as the command line takes it."""
    port = {e.label.removeprefix("RoboMaster "): e.address.rpartition(":")[2] for e in door.endpoints}
    return (
        f"robomaster://{EP_ADDRESS}:{port['text SDK']}?event={port['events']}&video={port['video']}"
        f"&audio={port['audio']}&push={door._config.push_port}&local=127.0.0.1"
    )
