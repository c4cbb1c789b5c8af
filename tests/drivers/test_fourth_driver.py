"""A further driver is a ``DriverType``: the program makes, connects and closes it, and every door shows its robot."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import httpx
import pytest

from roboglot.clients.errors import LinkLost
from roboglot.drivers import DRIVERS
from roboglot.drivers.driver import Driver
from roboglot.drivers.driver_type import DriverType, Target, Workshop
from roboglot.drivers.linked_base import LinkedBase
from roboglot.drivers.reported import ReportedBattery
from roboglot.drivers.urls import Drivers
from roboglot.fleet import UNKNOWN
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.base import Base, BaseLimits
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.errors import Unconnected
from roboglot.model.geometry import STILL, Twist
from roboglot.model.robot import Robot
from roboglot.model.sensing import BatteryState
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from tests.drivers.clients import Drive, Until


class CartBase(LinkedBase):
    """Sends each velocity as a line."""

    built = BaseLimits(twist=Twist(1.0, yaw=1.0), linear_acceleration=1.0, angular_acceleration=1.0, holonomic=False)
    limits = built
    velocity = STILL

    def __init__(self, driver: CartDriver) -> None:
        super().__init__(driver.link)
        self._driver = driver

    def set_velocity(self, twist: Twist) -> None:
        self.check(twist)
        if twist != self.velocity:
            self._driver.say(f"drive {twist.x:.2f} {twist.yaw:.2f}")
        self.velocity = twist


class CartDriver(Driver):
    """A cart that takes ``drive X YAW`` and says ``charge PERCENT``, a line each."""

    writer: asyncio.StreamWriter | None = None
    charge = 0.0

    def __init__(self, robot: Robot, target: Target, *, touches: bool) -> None:
        super().__init__(robot, target.url, touches=touches)
        self.target = target
        robot.add(Base, CartBase(self))
        robot.add(Battery, ReportedBattery(lambda: BatteryState(self.charge, 24.0, 0.0, 20.0, False, 0)))

    def say(self, line: str) -> None:
        if self.writer is not None:
            self.writer.write(f"{line}\n".encode())

    async def begin(self) -> None:
        await self.hang_up()
        self.reader, self.writer = await asyncio.open_connection(self.target.host, self.target.port)

    async def serve(self) -> None:
        while line := await self.reader.readline():
            self.charge = float(line.split()[1]) / 100.0
        raise LinkLost("the cart hung up")

    async def brake(self) -> None:
        self.say("drive 0.00 0.00")

    async def hang_up(self) -> None:
        if self.writer is not None:
            self.writer.close()


def make(workshop: Workshop, robot: Robot, target: Target) -> Driver:
    return CartDriver(robot, target, touches=workshop.touches)


DRIVER = DriverType("cart", make, options=frozenset(("colour",)))


class Cart:
    """The robot's end: what it heard, and its connections."""

    def __init__(self) -> None:
        self.heard: list[str] = []
        self.writers: list[asyncio.StreamWriter] = []

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.writers.append(writer)
        writer.write(b"charge 64\n")
        while line := await reader.readline():
            self.heard.append(line.decode().strip())


@pytest.fixture
async def cart(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[tuple[Cart, str]]:
    """A cart, and its URL."""
    monkeypatch.setattr("roboglot.drivers.urls.DRIVERS", (*DRIVERS, DRIVER))
    made = Cart()
    server = await asyncio.start_server(made.serve, "127.0.0.84", 0)
    yield made, f"cart://127.0.0.84:{server.sockets[0].getsockname()[1]}?colour=red"
    for writer in made.writers:
        writer.close()
    server.close()


async def test_a_fourth_driver_is_a_value(cart: tuple[Cart, str], drive: Drive, until: Until) -> None:
    its, url = cart
    robot = await drive(url)
    await until(lambda: robot[Battery].state.percentage == 0.64)
    door = SlamwareDoor(robot, "127.0.0.85", SlamwareConfig(port=0))
    await door.start()
    async with httpx.AsyncClient(base_url=f"http://127.0.0.85:{door.port}", verify=False) as client:
        status = (await client.get("/api/core/system/v1/power/status")).json()
        assert status["batteryPercentage"] == 64
    await door.close()
    robot[Base].set_velocity(Twist(0.5))
    await until(lambda: its.heard == ["drive 0.50 0.00"])
    its.writers[0].close()
    await until(lambda: robot[Link].state is LinkState.LOST)
    assert robot[Link].reason == "the cart hung up"
    with pytest.raises(Unconnected):
        robot[Base].set_velocity(Twist(0.2))
    await until(lambda: robot[Link].state is LinkState.UP)  # the supervisor has reconnected


def test_options_that_driver_does_not_name_are_refused(cart: tuple[Cart, str], clock: LockstepClock) -> None:
    with pytest.raises(ValueError, match="unknown options: size"):
        Drivers().add(Robot("b", UNKNOWN, clock), f"{cart[1]}&size=3")
