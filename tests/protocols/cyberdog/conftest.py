"""The door on a free port with TLS, and a phone (phone.py) beside it."""

from __future__ import annotations

import asyncio
from asyncio import AbstractEventLoop
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path

import grpc
import pytest
import uvloop

from roboglot.autonomy.navigation.driving import OdometryDriving
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.driving import Driving
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.model.stage import StagePerson
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world
from roboglot.testing import Forward
from tests.drivers.settling import settle
from tests.protocols.cyberdog.phone import ADDRESS, PATIENCE, App, Client, Messages, Pems


@pytest.hookimpl(optionalhook=True)
def pytest_asyncio_loop_factories() -> dict[str, Callable[[], AbstractEventLoop]]:
    """Run the tests on the loop that robots have: it takes a sixth of their processor time less than asyncio's own."""
    return {"uvloop": uvloop.new_event_loop}


@pytest.fixture(scope="session")
def messages(tmp_path_factory: pytest.TempPathFactory) -> Messages:
    return Messages(tmp_path_factory.mktemp("proto"))


@pytest.fixture
def passing(forward: Forward) -> Callable[[Callable[[], object]], Awaitable[None]]:
    """``await passing(condition)``: robot time passes until ``condition`` holds."""

    async def wait(condition: Callable[[], object]) -> None:
        async with asyncio.timeout(4 * PATIENCE):
            while not condition():
                await forward(seconds=0.1)
                await settle()

    return wait


@pytest.fixture(scope="session")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The robot's data folder; its certificates serve all tests."""
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="session")
def pems(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Pems:
    return Pems(*(path.read_bytes() for path in export_client(data / "cyberdog", tmp_path_factory.mktemp("phone"))))


@pytest.fixture
async def app(messages: Messages, pems: Pems) -> AsyncIterator[App]:
    opened = App(messages)
    pair = ((pems.key, pems.certificate),)
    await opened.start(grpc.ssl_server_credentials(pair, pems.ca, require_client_auth=True))
    yield opened
    await opened.stop()


@pytest.fixture
async def door(robot: Robot, data: Path, app: App) -> AsyncIterator[CyberDogDoor]:
    """A robot that learns the app's address from the first request."""
    opened = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app_port=app.port), data)
    app.robot = opened
    await opened.start()
    yield opened
    await opened.close()  # the fleet waits until the robot stands


@pytest.fixture
async def client(door: CyberDogDoor, pems: Pems, messages: Messages) -> AsyncIterator[Client]:
    async with pems.channel(door.port) as channel:
        yield Client(channel, messages)


@pytest.fixture
async def anna(
    world: World, client: Client, app: App, passing: Callable[[Callable[[], object]], Awaitable[None]]
) -> StagePerson:
    """A person three metres ahead of the robot, whose app is connected."""
    person = world.stage.person("anna")
    world.stage.place("a", Pose(person.pose.x - 3.0, person.pose.y, 0.0))
    await client.ask(10001)
    await passing(lambda: app.connected)
    return person


@pytest.fixture
async def walker(clock: LockstepClock) -> AsyncIterator[tuple[World, Robot]]:
    """A robot that can only walk, without the lidar's skills: quick to make."""
    world = World(load_world("office"), [RobotPlacement("a", "universal")], clock=clock, seed=1)
    robot = Robot("a", world.description_of("a"), clock)
    world.equip(robot)
    robot.add(Driving, OdometryDriving(robot))
    await world.prepare(wait=True)
    world.start()
    yield world, robot
    world.close()
