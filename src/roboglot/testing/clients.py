"""Clients of the robots under test, for each protocol."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from roboglot.testing.blocking import Blocking, Loop

if TYPE_CHECKING:
    from roboglot.clients.cyberdog import Certificates, CyberDogClient
    from roboglot.clients.robomaster.client import RoboMasterClient
    from roboglot.clients.slamware import SlamwareClient
    from roboglot.testing.programs import ProgramClient


class Clients:
    """Makes clients of the robots at ``addresses``; of the first unless another is named.

    ``data``: the server's folder; ``app_port``: port of the dog's app; ``loop``: event loop of the robots.
    """

    def __init__(self, addresses: Mapping[str, str], data: Path, app_port: int, loop: Loop) -> None:
        self._addresses, self._data, self._app_port, self._loop = addresses, data, app_port, loop
        self._opened = contextlib.ExitStack()

    def new_rest(self, robot: str = "") -> SlamwareClient:
        """Return an asyncio client of the REST API, not connected."""
        from roboglot.clients.slamware import SlamwareClient

        return SlamwareClient(self._address(robot))

    def new_robomaster(self, robot: str = "") -> RoboMasterClient:
        """Return an asyncio client of the text protocol; it connects from the robot's own address."""
        from roboglot.clients.robomaster.client import RoboMasterClient

        address = self._address(robot)
        return RoboMasterClient(address, local=address)

    def new_cyberdog(self, robot: str = "") -> CyberDogClient:
        """Return an asyncio client of the dog's app protocol, with certificates."""
        from roboglot.clients.cyberdog import CyberDogClient

        return CyberDogClient(self._address(robot), self.certificates(), app_port=self._app_port)

    def new_program(self, robot: str = "") -> ProgramClient:
        """Return an asyncio client that runs block programs."""
        from roboglot.testing.programs import ProgramClient

        return ProgramClient(self._address(robot))

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
        return self._addresses[robot] if robot else next(iter(self._addresses.values()))
