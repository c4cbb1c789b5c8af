"""A client of our own door."""

from collections.abc import AsyncIterator

import pytest

from roboglot.clients.slamware import SlamwareClient
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor


@pytest.fixture
async def door(robot: Robot) -> AsyncIterator[SlamwareDoor]:
    """The door of the simulated robot; closing it stops the robot, for which the fleet lets time pass."""
    made = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await made.start()
    yield made
    await made.close()


@pytest.fixture
async def client(robot: Robot, door: SlamwareDoor) -> AsyncIterator[SlamwareClient]:
    """Connected to it, on the robot's clock."""
    async with SlamwareClient("127.0.0.1", door.port, clock=robot.clock) as made:
        yield made
