"""Whereabouts of robots, by the registry of their homes: for clients that follow one from program to program."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import dataclass

from roboglot.storage.homes import Home, Homes
from roboglot.storage.transactions import DatabaseError

log = logging.getLogger(__name__)
PERIOD = 1.0  # s between two checks of a connected robot
PORT_MAX = 65535


@dataclass(frozen=True, slots=True)
class Gateway:
    """Behind which a robot is: its address, the SHA-256 of its certificate, and the epoch of the robot's home."""

    host: str
    port: int
    certificate: str
    epoch: int


class Whereabouts:
    """Asks the registry."""

    def __init__(self, homes: Homes) -> None:
        self._homes = homes

    async def of(self, robot: str) -> Gateway | None:
        """Return the robot's gateway; None: nothing runs it, or not behind a gateway. Raises OSError."""
        try:
            home = await self._homes.of(robot)
        except DatabaseError as error:
            raise OSError(f"the registry: {error}") from None
        return _gateway(home) if home is not None and home.holder and home.gateway else None

    async def moved(self, robot: str, epoch: int) -> None:
        """Return when the robot is behind a gateway under another epoch; a registry that is away knows of none."""
        while True:
            await asyncio.sleep(PERIOD)
            try:
                now = await self.of(robot)
            except OSError as error:
                log.info("robot %s is taken for unmoved: %s", robot, error)
                continue
            if now is not None and now.epoch != epoch:
                return


def _gateway(home: Home) -> Gateway:
    """Read a home. Raises OSError if the registry's text is no address."""
    host, _, port = home.gateway.rpartition(":")
    if not (host and port.isascii() and port.isdigit() and 0 < int(port) <= PORT_MAX):
        raise OSError(f"the registry has no gateway of robot {home.robot}, but {home.gateway!r}")
    return Gateway(host.strip("[]"), int(port), home.certificate, home.epoch)
