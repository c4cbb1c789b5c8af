"""Gateways of robots, from the registry, for clients that follow a robot from program to program."""

from __future__ import annotations

import asyncio
import logging

from roboglot.storage.robot_registry import Claim, RobotRegistry
from roboglot.storage.transactions import FAILURES
from roboglot.transport.log_limiter import LogLimiter
from roboglot.values import dataclass

log = logging.getLogger(__name__)
PERIOD = 1.0  # s between two checks of a connected robot
PORT_MAX = 65535


@dataclass(frozen=True, slots=True)
class Gateway:
    """Gateway of a robot: address, SHA-256 of its certificate, and epoch of the claim to the robot."""

    host: str
    port: int
    certificate: str
    epoch: int


class GatewayLookup:
    """Looks gateways up in the registry."""

    def __init__(self, registry: RobotRegistry) -> None:
        self._registry = registry

    async def of(self, robot: str) -> Gateway | None:
        """Return the robot's gateway; None if the robot does not run, or has no gateway. Raises OSError."""
        try:
            claim = await self._registry.of(robot)
        except FAILURES as error:
            raise OSError(f"the registry: {error}") from None
        return _gateway(claim) if claim is not None and claim.holder and claim.gateway else None

    async def moved(self, robot: str, epoch: int) -> None:
        """Return when the robot has a gateway under another epoch; wait on while the registry is unreachable."""
        seldom = LogLimiter(log)
        while True:
            await asyncio.sleep(PERIOD)
            try:
                now = await self.of(robot)
            except OSError as error:
                seldom.info(robot, "cannot look up robot %s, it counts as unmoved: %s", robot, error)
                continue
            if now is not None and now.epoch != epoch:
                return


def _gateway(claim: Claim) -> Gateway:
    """Return the gateway of a claim's program. Raises OSError if its text in the registry is not an address."""
    host, _, port = claim.gateway.rpartition(":")
    if not (host and port.isascii() and port.isdigit() and 0 < int(port) <= PORT_MAX):
        raise OSError(f"the registry has no gateway of robot {claim.robot}, but {claim.gateway!r}")
    return Gateway(host.strip("[]"), int(port), claim.certificate, claim.epoch)
