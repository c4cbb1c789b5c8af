"""Keeps a robot's ports on an address of this machine; dials again when the tunnel is lost or the robot has moved."""

from __future__ import annotations

import asyncio
import errno
from collections.abc import Callable, Collection
from ipaddress import IPv4Network
from typing import Protocol

from roboglot.access.tunnel.connector import APPS, Connector, NotTrusted, Refused, Trust
from roboglot.hosting.error_text import in_words
from roboglot.values import dataclass

AGAIN_AFTER = 1.0  # s
SOON = 0.5  # s between two look-ups of a robot that no program runs at present


class Unusable(Exception):
    """The address or one of its ports is unavailable; a retry would fail, too."""


class Ended(Exception):
    """The tunnel is lost, and was wanted once only."""


@dataclass(frozen=True, slots=True)
class Gateway:
    """A gateway. ``epoch`` changes with each move of the robot."""

    host: str
    port: int
    trust: Trust
    epoch: int = 0


class Gateways(Protocol):
    """Finds the gateway of a robot."""

    async def of(self, robot: str, /) -> Gateway | None:
        """Return the robot's gateway; None if it has none at present. Raises OSError."""

    async def moved(self, robot: str, gateway: Gateway, /) -> None:
        """Return when this is the robot's gateway no longer."""


class FixedGateway:
    """One fixed gateway for all robots."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway

    async def of(self, _robot: str, /) -> Gateway:
        """Return the gateway."""
        return self._gateway

    async def moved(self, _robot: str, _gateway: Gateway, /) -> None:
        """Wait forever: robots do not move."""
        await asyncio.Event().wait()


class Dialling:
    """Connection to one robot. ``ready`` and ``say`` report open ports and one line about failures to the user."""

    def __init__(
        self,
        gateways: Gateways,
        robot: str,
        token: str,
        address: str,
        ready: Callable[[str, list[int], str, bool], None],
        say: Callable[[str], None],
        apps: Collection[int] = APPS,
    ) -> None:
        self._gateways, self._robot, self._token, self._address = gateways, robot, token, address
        self._ready, self._say, self._apps = ready, say, apps
        self._said = ""

    async def keep(self, *, once: bool = False) -> None:
        """Keep the ports open; ``once``: until the tunnel is lost (Ended). Raises NotTrusted, Refused, Unusable."""
        while True:
            gateway = await self._find()
            lost = await self._carry(gateway)
            if once:
                raise Ended(f"robot {self._robot}: {lost or 'it moved'}")
            if lost:
                self._say_once(f"{lost}; trying again")
                await asyncio.sleep(AGAIN_AFTER)
            else:
                self._say_once("it moved")

    async def _find(self) -> Gateway:
        while True:
            try:
                if gateway := await self._gateways.of(self._robot):
                    return gateway
                self._say_once("no gateway is known that leads to it now")
            except OSError as error:
                self._say_once(str(error))
            await asyncio.sleep(SOON)

    async def _carry(self, gateway: Gateway) -> str:
        """Carry the ports until the tunnel is lost or the robot has moved; return why it is lost, "" if it moved."""
        robot, token, address = self._robot, self._token, self._address
        connector = Connector(gateway.host, gateway.port, robot, token, address, gateway.trust, self._apps)
        running = asyncio.ensure_future(connector.run(self._open))
        moving = asyncio.ensure_future(self._gateways.moved(self._robot, gateway))
        try:
            await asyncio.wait([running, moving], return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (running, moving):
                task.cancel()
            (outcome, _) = await asyncio.gather(running, moving, return_exceptions=True)
        if isinstance(outcome, asyncio.CancelledError):
            return ""
        return await self._lost(outcome, gateway)

    def _open(self, ports: list[int], fingerprint: str, new: bool) -> None:
        self._said = ""
        self._ready(self._robot, ports, fingerprint, new)

    async def _lost(self, outcome: object, gateway: Gateway) -> str:
        """Return why a tunnel ended; "" if the robot has moved meanwhile."""
        match outcome:
            case NotTrusted() | Refused():
                if await self._is_there(gateway):
                    raise outcome
                return ""
            case OSError() | TimeoutError() | asyncio.IncompleteReadError():
                if unusable := _unusable(outcome, self._address):
                    raise Unusable(unusable) from None
                return f"{gateway.host}:{gateway.port}: {in_words(outcome) or 'no answer'}"
            case BaseException():
                raise outcome
        return ""

    async def _is_there(self, gateway: Gateway) -> bool:
        """Return whether ``gateway`` is still the robot's."""
        try:
            now = await self._gateways.of(self._robot)
        except OSError:
            return True
        return now is not None and (now.host, now.port, now.epoch) == (gateway.host, gateway.port, gateway.epoch)

    def _say_once(self, why: str) -> None:
        if why != self._said:
            self._said = why
            self._say(f"robot {self._robot}: {why}")


def _unusable(error: BaseException, address: str) -> str:
    """Return why this address cannot be used, and a remedy; empty for other errors."""
    match getattr(error, "errno", None):
        case errno.EADDRNOTAVAIL:
            network = IPv4Network(f"{address}/24", strict=False)
            return f"{address} is not an address of this machine; run as root: ip route add local {network} dev lo"
        case errno.EADDRINUSE:
            return f"{getattr(error, 'strerror', error)}; --address chooses another one"
        case errno.EACCES:
            return str(getattr(error, "strerror", error))
    return ""
