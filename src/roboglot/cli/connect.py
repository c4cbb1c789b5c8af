"""``roboglot connect``: a robot behind a gateway as if it were on this machine, for unmodified clients."""

from __future__ import annotations

import itertools
import os
import sqlite3
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from ipaddress import IPv4Address, IPv4Network
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from urllib.parse import urlsplit

import typer

from roboglot.access.tunnel.connector import APPS, AnnouncedGateway, KnownGateways, NotTrusted, Refused
from roboglot.access.tunnel.dialling import Dialling, Ended, FixedGateway, Gateway, Gateways, Unusable
from roboglot.config import ROBOTS_MAX, is_loopback
from roboglot.hosting.error_text import in_words
from roboglot.hosting.escaping import visible
from roboglot.hosting.event_loop import run, together
from roboglot.hosting.logs import set_up_logging
from roboglot.text_files import named_text_of

if TYPE_CHECKING:
    from roboglot.storage.gateways import GatewayLookup

PORT = 50090


def command(
    gateway: Annotated[
        str, typer.Argument(help="HOST or HOST:PORT of the robots' gateway (their \\[access] gateway).")
    ] = "",
    robot: Annotated[
        list[str] | None, typer.Option(help="Name of a robot behind the gateway; repeat for more. Default: a.")
    ] = None,
    token_file: Annotated[Path | None, typer.Option(help="A file with the token; else ROBOGLOT_TOKEN.")] = None,
    address: Annotated[
        str, typer.Option(help="Address of this machine for the first robot; the others follow it.")
    ] = "",
    address_range: Annotated[
        str, typer.Option(help="Network for the addresses: 127.0.1.0/24, or with AnyIP 10.99.0.0/24.")
    ] = "",
    registry: Annotated[
        str, typer.Option(help="URL or file of a registry, instead of a gateway; follows robots that move.")
    ] = "",
    callback: Annotated[
        list[int] | None,
        typer.Option(
            help="Port of an app on this machine that the gateway may reach, by TCP or UDP; repeat for more. "
            "Default: 8981, 40924, 40926.",
            min=1,
            max=65535,
        ),
    ] = None,
    once: Annotated[bool, typer.Option("--once", help="End with status 1 when a tunnel is lost.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log every connection.")] = False,
) -> None:
    """Open the vendors' ports of robots on this machine, over one TLS connection each to the gateway."""
    set_up_logging(verbose)
    if bool(gateway) == bool(registry):
        sys.exit("roboglot connect: which robots: those of a gateway, or those of a --registry?")
    try:
        token = named_text_of(token_file) if token_file else os.environ.get("ROBOGLOT_TOKEN", "")
        names = robot or ["a"]
        if len({*names}) < len(names):
            raise ValueError("a robot is named twice")
        places = addresses(len(names), address, address_range)
        where = registered(registry) if registry else _one(gateway)
    except (OSError, ValueError) as error:
        sys.exit(f"roboglot connect: {in_words(error)}")
    if not token.strip():
        sys.exit("roboglot connect: a token is needed: --token-file FILE, or ROBOGLOT_TOKEN")
    for place in places:
        if not is_loopback(place):
            print(f"roboglot connect: anyone who can reach {place} acts with your token", file=sys.stderr)
    try:
        robots = dict(zip(names, places, strict=True))
        run(_keep_all(where, robots, token.strip(), frozenset(callback or APPS), once=once))
    except KeyboardInterrupt:
        sys.exit(130)
    except (NotTrusted, Refused, Unusable, Ended, OSError, ValueError, sqlite3.Error) as refused:
        sys.exit(f"roboglot connect: {in_words(refused)}")


def addresses(count: int, first: str, network: str) -> list[str]:
    """Return one address for each robot. Raises ValueError."""
    if not 1 <= count <= ROBOTS_MAX:
        raise ValueError(f"at most {ROBOTS_MAX} robots")
    if first and network:
        raise ValueError("give either --address or --address-range")
    if not network:
        start = IPv4Address(first or "127.0.0.1")
        return [str(start + number) for number in range(count)]
    hosts = list(itertools.islice(IPv4Network(network).hosts(), count))
    if len(hosts) < count:
        raise ValueError(f"{network} has {len(hosts)} addresses, and there are {count} robots")
    return [str(host) for host in hosts]


async def _keep_all(
    gateways: AbstractContextManager[Gateways], robots: dict[str, str], token: str, apps: frozenset[int], *, once: bool
) -> None:
    """Keep each robot's ports on its address."""
    with gateways as known:
        await together(
            *(
                Dialling(known, name, token, address, partial(_ready, address), _print, apps).keep(once=once)
                for name, address in robots.items()
            )
        )


def _ready(address: str, robot: str, ports: list[int], fingerprint: str, new: bool) -> None:
    first = "; seen for the first time: compare it with `roboglot doctor --security` there" if new else ""
    print(f"gateway {fingerprint}{first}", file=sys.stderr)
    print(f"ready: robot {robot} on {address}, ports {', '.join(map(str, ports))}", flush=True)


def _print(line: str) -> None:
    print(f"roboglot connect: {visible(line)}", file=sys.stderr)


class _RegisteredGateways:
    """Gateways from the registry of robots, which has each gateway's certificate."""

    def __init__(self, lookup: GatewayLookup) -> None:
        self._lookup = lookup

    async def of(self, robot: str) -> Gateway | None:
        """Return the robot's gateway, or None. Raises OSError."""
        found = await self._lookup.of(robot)
        if found is None:
            return None
        return Gateway(found.host, found.port, AnnouncedGateway(found.certificate), found.epoch)

    async def moved(self, robot: str, gateway: Gateway) -> None:
        """Return when the registry has another gateway of the robot."""
        await self._lookup.moved(robot, gateway.epoch)


@contextmanager
def registered(registry: str) -> Iterator[Gateways]:
    """Context to find robots by a registry: a PostgreSQL URL, or a file. Raises OSError, ValueError, sqlite3.Error."""
    from roboglot.storage.gateways import GatewayLookup
    from roboglot.storage.opening import read_registry
    from roboglot.storage.robot_registry import RobotRegistry

    database = read_registry(registry)
    try:
        yield _RegisteredGateways(GatewayLookup(RobotRegistry(database)))
    finally:
        database.close()


def _one(gateway: str) -> AbstractContextManager[Gateways]:
    """Return the given gateway as that of all robots. Raises ValueError."""
    try:
        parts = urlsplit(f"//{gateway}")
        host, port = parts.hostname, parts.port or PORT
    except ValueError:
        host = None
    if not host or gateway.endswith(":") or parts.netloc != gateway:
        raise ValueError(f"{gateway!r} is not HOST or HOST:PORT, such as [::1]:50090")
    return nullcontext(FixedGateway(Gateway(host, port, KnownGateways(_settings() / "gateways.json"))))


def _settings() -> Path:
    home = Path(os.environ.get("HOME", "/tmp"))
    return Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config") / "roboglot"
