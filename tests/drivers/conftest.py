"""A chain on one virtual clock: a simulated robot, its door, a driver connected to that, and another door in front."""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Literal

import pytest

from roboglot.clients.slamware import SlamwareClient
from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.robot import Robot
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.storage.database import Database
from roboglot.testing import Forward
from tests.drivers import bad_link
from tests.drivers.bad_link import Connect
from tests.drivers.clients import EP_ADDRESS, Drive, Open, OpenRest, TextClient, Until, ep_config, url_of
from tests.drivers.rig import Rig, rig, time_passes
from tests.drivers.settling import settle

Profile = Literal["spec", "fw60", "fw70"]


@pytest.fixture
def until(forward: Forward) -> Until:
    """Robot time passes until the condition holds."""

    async def wait(condition: Callable[[], object], patience: float = 20.0, step: float = 0.1) -> None:
        for _ in range(int(patience / step)):
            if condition():
                return
            await forward(seconds=step)
            await settle()
        raise AssertionError("it did not happen")

    return wait


@pytest.fixture
async def slamware_door(robot: Robot, forward: Forward) -> AsyncIterator[SlamwareDoor]:
    """The simulated robot behind REST."""
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await door.start()
    yield door
    await door.close()
    await forward(seconds=1)


@pytest.fixture
async def drive(clock: LockstepClock) -> AsyncIterator[Drive]:
    """Connect a driver to a URL; the robot that it makes."""
    fleets: list[tuple[Fleet, Database]] = []

    async def connect(url: str) -> Robot:
        database = Database(":memory:")
        fleet = build_fleet("empty", [RobotConfig("b", url)], clock=clock, seed=1, database=database)
        fleets.append((fleet, database))
        await fleet.start(wait=True)
        return fleet.robots["b"]

    yield connect
    for fleet, database in fleets:
        await fleet.close()
        database.close()


@pytest.fixture
async def driven(slamware_door: SlamwareDoor, drive: Drive, forward: Forward) -> Robot:
    """The robot as the Slamware driver has it."""
    await forward(seconds=2)
    robot = await drive(f"slamware://127.0.0.1:{slamware_door.port}")
    assert robot[Link].state is LinkState.UP
    return robot


@pytest.fixture
async def text_door() -> AsyncIterator[Open]:
    """Put the text protocol in front of a robot; a client in SDK mode."""
    opened: list[tuple[RoboMasterDoor, TextClient]] = []

    async def open_one(robot: Robot) -> TextClient:
        config = RoboMasterConfig(control_port=0, event_port=0, video_port=0, audio_port=0, push_port=9)
        door = RoboMasterDoor(robot, "127.0.0.77", config)
        await door.start()
        port = next(int(e.address.rpartition(":")[2]) for e in door.endpoints if e.label == "RoboMaster text SDK")
        client = TextClient(*await asyncio.open_connection("127.0.0.77", port))
        assert await client.ask("command;") == "ok"
        opened.append((door, client))
        return client

    yield open_one
    for door, client in opened:
        client.writer.transport.abort()
        await door.close()


@pytest.fixture
def profile() -> Profile:
    """Return the profile of the text protocol: the manual's."""
    return "spec"


@pytest.fixture
async def ep_door(profile: Profile, robot: Robot, forward: Forward) -> AsyncIterator[RoboMasterDoor]:
    """The simulated robot behind the text protocol."""
    door = RoboMasterDoor(robot, EP_ADDRESS, dataclasses.replace(ep_config(), profile=profile))
    await door.start()
    yield door
    await door.close()
    await forward(seconds=1)


@pytest.fixture
async def driven_ep(ep_door: RoboMasterDoor, drive: Drive, forward: Forward) -> Robot:
    """The robot as the RoboMaster driver has it."""
    await forward(seconds=1)
    robot = await drive(url_of(ep_door))
    assert robot[Link].state is LinkState.UP
    await forward(seconds=0.2)
    return robot


@pytest.fixture
async def rest() -> AsyncIterator[OpenRest]:
    """Put REST in front of a robot; a client of it."""
    opened: list[tuple[SlamwareDoor, SlamwareClient]] = []

    async def open_one(robot: Robot) -> SlamwareClient:
        door = SlamwareDoor(robot, "127.0.0.79", SlamwareConfig(port=0))
        await door.start()
        opened.append((door, SlamwareClient("127.0.0.79", door.port, clock=robot.clock)))
        return opened[-1][1]

    yield open_one
    for door, client in opened:
        client.close()
        await door.close()


@pytest.fixture
async def way(back: str, robot: Robot, tmp_path: Path, forward: Forward) -> AsyncIterator[Rig]:
    await forward(seconds=2)
    async with rig(back, robot, tmp_path) as made:
        yield made


@pytest.fixture
def connect(way: Rig, drive: Drive, forward: Forward) -> Connect:
    """A driver at the other end of ``way``; robot time passes by itself while it is used."""

    @asynccontextmanager
    async def connected() -> AsyncIterator[Robot]:
        async with time_passes(forward, threads=way.back == "cyberdog"):
            robot = await drive(way.url)
            if way.back == "cyberdog" and not way.fault.refusing:
                await bad_link.until(robot.clock, lambda: robot[Localization].enabled)
            yield robot

    return connected
