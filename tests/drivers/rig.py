"""Each kind of robot behind its own vendor's door, with relays in between that a fault can be put on."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

from roboglot.clients.cyberdog import Certificates, CyberDogClient
from roboglot.drivers.robomaster.chapters.chassis import RoboMasterBase
from roboglot.model.components.motion.base import Base
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.testing import Forward
from roboglot.testing.addresses import free_port
from tests.drivers.clients import EP_ADDRESS
from tests.drivers.link_proxy import Fault, Proxy, UdpProxy
from tests.drivers.settling import settle
from tests.narrowing import known, of_kind

Door = SlamwareDoor | RoboMasterDoor | CyberDogDoor
HOST = "127.0.0.1"


class Rig:
    """One robot, its door, and the relays in between. ``url``: for a driver; ``fault``: of the link."""

    def __init__(self, back: str, robot: Robot, folder: Path) -> None:
        self.back, self.url, self.fault = back, "", Fault()
        self.proxies: list[Proxy] = []
        self._robot, self._folder = robot, folder
        self._ports = [free_port() for _ in range(4)]
        self._reported = UdpProxy(robot.clock, (HOST, free_port()), self.fault)
        self._door: Door | None = None

    async def open(self) -> None:
        """Open the relays, then the door."""
        clock, robot_at = self._robot.clock, EP_ADDRESS if self.back == "robomaster" else HOST
        if self.back == "robomaster":
            await self._reported.start()
        for port in self._ports[: 2 if self.back == "robomaster" else 1]:
            self.proxies.append(Proxy(clock, (robot_at, port), self.fault))
        driver_port = free_port()
        if self.back == "cyberdog":
            self.proxies.append(Proxy(clock, (HOST, driver_port), self.fault, back=True))
        for proxy in self.proxies:
            await proxy.start()
        await self.start()
        port = self.proxies[0].port
        match self.back:
            case "slamware":
                self.url = f"slamware://{HOST}:{port}"
            case "robomaster":
                _, event, video, audio = (self.proxies[0].port, self.proxies[1].port, *self._ports[2:])
                push = self._reported._target[1]
                ports = f"event={event}&video={video}&audio={audio}&push={push}"
                self.url = f"robomaster://{HOST}:{port}?{ports}&local={HOST}"
            case _:
                self.hand_out_certificates()
                self.url = f"cyberdog://{HOST}:{port}?certs={self._folder / 'driver'}&app={driver_port}"

    async def start(self) -> None:
        """Open the robot's door."""
        control, event, video, audio = self._ports
        match self.back:
            case "slamware":
                self._door = SlamwareDoor(self._robot, HOST, SlamwareConfig(port=control))
            case "robomaster":
                config = RoboMasterConfig(control, video, audio, self._reported.port, event, free_port())
                self._door = RoboMasterDoor(self._robot, EP_ADDRESS, config)
            case _:
                dog = CyberDogConfig(port=control, app_port=self.proxies[-1].port)
                self._door = CyberDogDoor(self._robot, HOST, dog, self._folder)
        await self._door.start()

    async def stop(self) -> None:
        """Close the door and its connections, as if the robot were switched off."""
        if self._door:
            await self._door.close()
            self._door = None

    def hand_out_certificates(self) -> None:
        """Give the certificates of the dog's authority to the driver."""
        shutil.rmtree(self._folder / "driver", ignore_errors=True)
        export_client(self._folder / "cyberdog", self._folder / "driver")

    def lose_certificates(self) -> None:
        """Delete the dog's certificates; it makes new ones at its start."""
        shutil.rmtree(self._folder / "cyberdog")

    @asynccontextmanager
    async def second_app(self) -> AsyncIterator[CyberDogClient]:
        """Yield another app of the dog, connected past the relays."""
        proof = Certificates.load(self._folder / "driver")
        port = self._ports[0]
        async with CyberDogClient(HOST, proof, port=port, app_port=free_port(), clock=self._robot.clock) as app:
            yield app

    def cut(self) -> None:
        """Break all connections."""
        for proxy in self.proxies:
            proxy.cut()

    async def close(self) -> None:
        """Close everything."""
        for proxy in self.proxies:
            await proxy.close()
        await self._reported.close()
        await self.stop()


@asynccontextmanager
async def rig(back: str, robot: Robot, folder: Path) -> AsyncIterator[Rig]:
    """Yield an open rig."""
    async with AsyncExitStack() as stack:
        made = Rig(back, robot, folder)
        stack.push_async_callback(made.close)
        await made.open()
        yield made


@asynccontextmanager
async def time_passes(forward: Forward, *, step: float = 0.02, threads: bool = True) -> AsyncIterator[None]:
    """Let robot time pass in steps of ``step`` s. ``threads``: wait after each for threads that keep no robot time."""
    over = False

    async def pass_time() -> None:
        while not over:
            await forward(seconds=step)
            await (settle() if threads else asyncio.sleep(0))

    task = asyncio.ensure_future(pass_time())
    try:
        yield
    finally:
        over = True
        await task


def cut_session(base: Base) -> None:
    """Break the driver's connection to an EP, as losing Wi-Fi does."""
    known(known(of_kind(base, RoboMasterBase)._client._link)._transport).abort()
