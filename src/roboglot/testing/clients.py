"""Clients of the robots under test, for each protocol."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from roboglot.spelling import instead
from roboglot.testing.blocking import Blocking, Loop

if TYPE_CHECKING:
    from roboglot.clients.cyberdog import Certificates, CyberDogClient
    from roboglot.clients.robomaster.client import RoboMasterClient
    from roboglot.clients.slamware import SlamwareClient
    from roboglot.config import Config
    from roboglot.testing.programs import ProgramClient


class Clients:
    """Makes clients of the robots in ``config``, which has every door's section; of the first unless one is named.

    ``loop``: event loop of the robots.
    """

    def __init__(self, config: Config, loop: Loop) -> None:
        self._addresses = {robot.name: robot.address for robot in config.robots}
        self._data, self._doors, self._loop = config.data, config.doors, loop
        self._opened = contextlib.ExitStack()

    @property
    def app_port(self) -> int:
        """Port of the dog's app, which the robots call."""
        dog = self._doors["cyberdog"]
        return int(dog.app.rpartition(":")[2]) if dog.app else dog.app_port

    def new_rest(self, robot: str = "") -> SlamwareClient:
        """Return an asyncio client of the REST API, not connected."""
        from roboglot.clients.slamware import SlamwareClient

        return SlamwareClient(self._address(robot), self._doors["slamware"].port)

    def new_robomaster(self, robot: str = "") -> RoboMasterClient:
        """Return an asyncio client of the text protocol; it connects from the robot's own address."""
        from roboglot.clients.robomaster.client import Ports, RoboMasterClient

        address, door = self._address(robot), self._doors["robomaster"]
        ports = Ports(door.control_port, door.video_port, door.audio_port, door.event_port, door.push_port)
        return RoboMasterClient(address, ports=ports, local=address)

    def new_cyberdog(self, robot: str = "") -> CyberDogClient:
        """Return an asyncio client of the dog's app protocol, with certificates."""
        from roboglot.clients.cyberdog import CyberDogClient

        door = self._doors["cyberdog"]
        certificates = None if door.plaintext else self.certificates()
        return CyberDogClient(self._address(robot), certificates, port=door.port, app_port=self.app_port)

    def new_program(self, robot: str = "") -> ProgramClient:
        """Return an asyncio client that runs block programs."""
        from roboglot.testing.programs import ProgramClient

        return ProgramClient(self._address(robot), self._doors["visual"].port)

    def certificates(self) -> Certificates:
        """Return the certificates of a dog's app; the files are in ``data/app``."""
        from roboglot.clients.cyberdog import Certificates
        from roboglot.protocols.cyberdog.certificates import export_client
        from roboglot.protocols.cyberdog.pem_files import FOLDER

        folder = self._data / "app"
        if not folder.exists():
            export_client(self._data / FOLDER, folder)
        return Certificates.load(folder)

    def open(self, client: object) -> Blocking:
        """Connect an asyncio client in the robots' loop; its methods block. ``close`` and ``reset`` close it."""
        return self._opened.enter_context(Blocking(client, self._loop))

    def close(self) -> None:
        """Close all open clients."""
        self._opened.close()

    def _address(self, robot: str) -> str:
        if robot and robot not in self._addresses:
            raise ValueError(f"there is no robot {robot!r}{instead(robot, self._addresses)}")
        return self._addresses[robot] if robot else next(iter(self._addresses.values()))
