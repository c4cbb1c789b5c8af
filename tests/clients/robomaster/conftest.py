"""Our own door on free ports, in this process and in lockstep, and a client of it."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

import pytest

from roboglot.clients.robomaster.client import Ports, RoboMasterClient
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.testing.addresses import free_port
from tests.drivers.settling import settle

ADDRESS = "127.0.0.9"
Run = Callable[[Awaitable[Any]], Awaitable[Any]]


@pytest.fixture
def profile(request) -> str:
    return str(getattr(request, "param", "spec"))


@pytest.fixture
async def door(robot, profile) -> AsyncIterator[RoboMasterDoor]:
    config = RoboMasterConfig(
        control_port=0, event_port=0, video_port=0, audio_port=0, push_port=free_port(),
        broadcast_port=free_port(), profile=profile,
    )  # fmt: skip
    opened = RoboMasterDoor(robot, ADDRESS, config)
    await opened.start()
    yield opened
    await opened.close()  # the fleet waits until the robot stands


def ports_of(door: RoboMasterDoor) -> Ports:
    port = {e.label.removeprefix("RoboMaster "): e.address.rpartition(":")[2] for e in door.endpoints}
    return Ports(
        int(port["text SDK"]), int(port["video"]), int(port["audio"]), int(port["events"]), door._config.push_port
    )


@pytest.fixture
async def client(door, robot) -> AsyncIterator[RoboMasterClient]:
    async with RoboMasterClient(ADDRESS, clock=robot.clock, ports=ports_of(door), local="127.0.0.1") as opened:
        yield opened


@pytest.fixture
def run(robot) -> Run:
    """Await something while robot time passes: at least the time that our messages take on the machine."""

    async def pass_time(awaitable: Awaitable[Any]) -> Any:
        task = asyncio.ensure_future(awaitable)
        for _ in range(400):
            await settle()
            if task.done():
                break
            await robot.clock.advance(0.02)
        return await task

    return pass_time
