"""Gateways of robots, from the registry of their homes, for clients that follow a robot from program to program."""

from __future__ import annotations

import asyncio
import logging

from roboglot.storage.homes import Home, Homes
from roboglot.storage.transactions import FAILURES
from roboglot.values import dataclass

log = logging.getLogger(__name__)
PERIOD = 1.0  # s between two checks of a connected robot
PORT_MAX = 65535


@dataclass(frozen=True, slots=True)
class Gateway:
    """Gateway of a robot: address, SHA-256 of its certificate, and epoch of the robot's home."""

    host: str
    port: int
    certificate: str
    epoch: int


class Whereabouts:
    """Looks gateways up in the registry."""

    def __init__(self, homes: Homes) -> None:
        self._homes = homes

    async def of(self, robot: str) -> Gateway | None:
        """Return the robot's gateway; None if the robot does not run, or has no gateway. Raises OSError."""
        try:
            home = await self._homes.of(robot)
        except FAILURES as error:
            raise OSError(f"the registry: {error}") from None
        return _gateway(home) if home is not None and home.holder and home.gateway else None

    async def moved(self, robot: str, epoch: int) -> None:
        """Return when the robot has a gateway under another epoch; wait on while the registry is unreachable."""
        while True:
            await asyncio.sleep(PERIOD)
            try:
                now = await self.of(robot)
            except OSError as error:
                log.info("cannot look up robot %s, it counts as unmoved: %s", robot, error)
                continue
            if now is not None and now.epoch != epoch:
                return


def _gateway(home: Home) -> Gateway:
    """Return a home's gateway. Raises OSError if its text in the registry is not an address."""
    host, _, port = home.gateway.rpartition(":")
    if not (host and port.isascii() and port.isdigit() and 0 < int(port) <= PORT_MAX):
        raise OSError(f"the registry has no gateway of robot {home.robot}, but {home.gateway!r}")
    return Gateway(host.strip("[]"), int(port), home.certificate, home.epoch)
