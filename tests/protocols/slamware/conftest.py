"""A door on a free port and a plain HTTP client."""

from asyncio import AbstractEventLoop
from collections.abc import AsyncIterator, Callable, Iterator

import httpx
import pytest
import uvloop

from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Description, Robot
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.world.world import World
from roboglot.storage.annotations import StoredAnnotations
from roboglot.storage.database import Database
from roboglot.storage.files import StoredFiles
from roboglot.storage.places import StoredPlaces
from roboglot.storage.settings import StoredSettings
from roboglot.testing import Forward
from tests.protocols.slamware.drawings import DESK, ICE, WALL, ok
from tests.protocols.slamware.screen import Screen

PLATE = Description(
    maker="Slamtec",
    model="Test",
    serial="D2E6D7C0F7ABF29EDFEAFEFE1C781D09",
    hardware_version="1",
    software_version="2.0",
    radius=0.2,
    height=0.3,
)


@pytest.hookimpl(optionalhook=True)
def pytest_asyncio_loop_factories() -> dict[str, Callable[[], AbstractEventLoop]]:
    """Run the tests on the loop that robots have: it takes a sixth of their processor time less than asyncio's own."""
    return {"uvloop": uvloop.new_event_loop}


async def serve(robot: Robot) -> AsyncIterator[SlamwareDoor]:
    """Yield an open door, closed afterwards."""
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await door.start()
    yield door
    await door.close()


@pytest.fixture
def bare(clock: LockstepClock) -> Iterator[Robot]:
    """A robot that has nothing but a memory: enough for all that is only HTTP."""
    robot = Robot("bare", PLATE, clock)
    database = Database(":memory:")
    robot.add(Places, StoredPlaces(database, "bare", clock, robot.events))
    robot.add(MapAnnotations, StoredAnnotations(database, "bare", clock, robot.events))
    robot.add(FileStore, StoredFiles(database, "bare", clock))
    robot.add(Settings, StoredSettings(database, "bare"))
    yield robot
    database.close()


@pytest.fixture
async def bare_door(bare: Robot) -> AsyncIterator[SlamwareDoor]:
    """The door of the bare robot."""
    async for door in serve(bare):
        yield door


@pytest.fixture
async def bare_client(bare_door: SlamwareDoor) -> AsyncIterator[httpx.AsyncClient]:
    """A client of the bare robot."""
    async with httpx.AsyncClient(base_url=bare_door.endpoints[0].address, timeout=60, verify=False) as client:
        yield client


@pytest.fixture
async def door(robot: Robot) -> AsyncIterator[SlamwareDoor]:
    """The door of the simulated robot; closing it stops the robot, for which the fleet lets time pass."""
    async for door in serve(robot):
        yield door


@pytest.fixture
async def client(door: SlamwareDoor) -> AsyncIterator[httpx.AsyncClient]:
    """A client of the simulated robot."""
    async with httpx.AsyncClient(base_url=door.endpoints[0].address, timeout=60, verify=False) as client:
        yield client


@pytest.fixture
def screen(client: httpx.AsyncClient, forward: Forward, world: World) -> Screen:
    """The screen of a delivery robot."""
    return Screen(client, forward, world)


@pytest.fixture
async def drawn(client: httpx.AsyncClient, forward: Forward) -> None:
    """A map with a place, a wall and an area on it."""
    artifact = "/api/core/artifact/v1"
    await forward(seconds=1)
    await ok(await client.post(f"{artifact}/pois", json=DESK))
    await ok(await client.post(f"{artifact}/lines/walls", json=[WALL]))
    await ok(await client.post(f"{artifact}/rectangle-areas/dangerous_area", json=ICE))
