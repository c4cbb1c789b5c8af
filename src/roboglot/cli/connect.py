"""``roboglot connect``: a robot behind a gateway as if it were on this machine, for unmodified clients."""

from __future__ import annotations

import asyncio
import errno
import itertools
import os
import sys
from collections.abc import Coroutine
from ipaddress import IPv4Address, IPv4Network
from pathlib import Path
from typing import Annotated, Any

import typer

from roboglot.access.tunnel.connector import Connector, KnownGateways, NotTrusted, Refused
from roboglot.config import is_loopback
from roboglot.hosting.logs import set_up_logging

PORT = 50090
AGAIN_AFTER = 1.0  # s
ROBOTS_MAX = 100


def command(
    gateway: Annotated[str, typer.Argument(help="HOST or HOST:PORT of the robots' gateway ([access] gateway there).")],
    robot: Annotated[list[str] | None, typer.Option(help="Its name there; repeat for more. Default: a.")] = None,
    token_file: Annotated[Path | None, typer.Option(help="A file with the token; else ROBOGLOT_TOKEN.")] = None,
    address: Annotated[str, typer.Option(help="Of this machine, for the first robot; the others follow.")] = "",
    address_range: Annotated[
        str, typer.Option(help="A network to take the addresses from: 127.0.1.0/24, or one of AnyIP: 10.99.0.0/24.")
    ] = "",
    once: Annotated[bool, typer.Option("--once", help="End when a tunnel is lost.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log every connection.")] = False,
) -> None:
    """Open robots' vendor ports here, and carry them over one TLS connection each to the gateway."""
    set_up_logging(verbose)
    host, _, port = gateway.rpartition(":") if gateway.rpartition(":")[2].isdigit() else (gateway, "", str(PORT))
    try:
        token = token_file.read_text() if token_file else os.environ.get("ROBOGLOT_TOKEN", "")
        names = robot or ["a"]
        places = addresses(len(names), address, address_range)
    except (OSError, ValueError) as error:
        sys.exit(f"roboglot connect: {error}")
    if not token.strip():
        sys.exit("roboglot connect: a token is needed: --token-file FILE, or ROBOGLOT_TOKEN")
    for place in places:
        if not is_loopback(place):
            print(f"roboglot connect: everyone who reaches {place} uses your token", file=sys.stderr)
    known = KnownGateways(_settings() / "gateways.json")
    connectors = {
        (name, place): Connector(host.strip("[]"), int(port), name, token.strip(), place, known)
        for name, place in zip(names, places, strict=True)
    }
    try:
        _run(_keep_all(connectors, once))
    except KeyboardInterrupt:
        sys.exit(130)
    except (NotTrusted, Refused, Unusable) as refused:
        sys.exit(f"roboglot connect: {refused}")


def _run(work: Coroutine[Any, Any, None]) -> None:
    """Run ``work`` on uvloop, or on asyncio's own loop in an installation without it."""
    try:
        import uvloop
    except ImportError:
        asyncio.run(work)
    else:
        uvloop.run(work)


class Unusable(Exception):
    """The address or a port of it cannot be had; another try would fare no better."""


def addresses(count: int, first: str, network: str) -> list[str]:
    """Return one address for each robot. Raises ValueError."""
    if not 1 <= count <= ROBOTS_MAX:
        raise ValueError(f"at most {ROBOTS_MAX} robots")
    if first and network:
        raise ValueError("either --address or --address-range")
    if not network:
        start = IPv4Address(first or "127.0.0.1")
        return [str(start + number) for number in range(count)]
    hosts = list(itertools.islice(IPv4Network(network).hosts(), count))
    if len(hosts) < count:
        raise ValueError(f"{network} has {len(hosts)} addresses, and there are {count} robots")
    return [str(host) for host in hosts]


async def _keep_all(connectors: dict[tuple[str, str], Connector], once: bool) -> None:
    tasks = [
        asyncio.ensure_future(_keep(connector, name, place, once)) for (name, place), connector in connectors.items()
    ]
    try:
        await asyncio.gather(*tasks)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _keep(connector: Connector, robot: str, address: str, once: bool) -> None:
    """Dial again whenever the tunnel is lost."""

    def ready(ports: list[int], fingerprint: str, new: bool) -> None:
        first = "; seen for the first time: compare it with `roboglot doctor --security` there" if new else ""
        print(f"gateway {fingerprint}{first}", file=sys.stderr)
        print(f"ready: robot {robot} on {address}, ports {', '.join(map(str, ports))}", flush=True)

    while True:
        try:
            await connector.run(ready)
        except (NotTrusted, Refused):
            raise
        except (OSError, TimeoutError, asyncio.IncompleteReadError) as error:
            if unusable := _unusable(error, address):
                raise Unusable(unusable) from None
            print(f"roboglot connect: robot {robot}: {error or type(error).__name__}", file=sys.stderr)
        if once:
            return
        await asyncio.sleep(AGAIN_AFTER)


def _unusable(error: BaseException, address: str) -> str:
    """Why this address cannot be listened at, and what to do; empty: that is not what went wrong."""
    match getattr(error, "errno", None):
        case errno.EADDRNOTAVAIL:
            network = IPv4Network(f"{address}/24", strict=False)
            return f"{address} is no address of this machine; as root: ip route add local {network} dev lo"
        case errno.EADDRINUSE:
            return f"{error}; --address chooses another one"
        case errno.EACCES:
            return str(error)
    return ""


def _settings() -> Path:
    home = Path(os.environ.get("HOME", "/tmp"))
    return Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config") / "roboglot"
