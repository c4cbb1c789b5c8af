"""A robot behind its CyberDog door, the client beside it, and robot time that passes by itself."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from roboglot.clients.cyberdog import Certificates, CyberDogClient
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.testing import Forward
from roboglot.testing.addresses import free_addresses, free_port
from tests.drivers.settling import settle

ADDRESS = free_addresses(1)


@pytest.fixture(scope="session")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("client data")


@pytest.fixture(scope="session")
def certificates(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Certificates:
    folder = tmp_path_factory.mktemp("phone")
    export_client(data / "cyberdog", folder)
    return Certificates.load(folder)


@pytest.fixture
async def door(robot: Robot, data: Path, forward: Forward) -> AsyncIterator[CyberDogDoor]:
    opened = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app_port=free_port()), data)
    await opened.start()
    passing = asyncio.ensure_future(_pass_time(forward))
    yield opened
    passing.cancel()
    await asyncio.gather(passing, return_exceptions=True)
    await opened.close()  # the fleet waits until the robot stands


async def _pass_time(forward: Forward) -> None:
    """A little faster than outside."""
    while True:
        await forward(seconds=0.05)
        await asyncio.sleep(0.01)
        await settle()


@pytest.fixture
async def client(door: CyberDogDoor, certificates: Certificates) -> AsyncIterator[CyberDogClient]:
    app_port = door._config.app_port
    async with CyberDogClient(ADDRESS, certificates, port=door.port, app_port=app_port) as opened:
        yield opened
