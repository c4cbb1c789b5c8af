"""``roboglot scan``: finds robots and prints how to connect to them.

RoboMasters broadcast while they are free; Slamware robots and CyberDogs are probed at the given addresses.
"""

from __future__ import annotations

import asyncio
import contextlib
import shlex
import ssl
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from ipaddress import ip_address, ip_network
from typing import Annotated

import typer

from roboglot.cli.numbers import finite
from roboglot.clients.errors import ClientError
from roboglot.clients.robomaster.datagrams import discover
from roboglot.clients.slamware import SlamwareClient
from roboglot.hosting.escaping import in_line
from roboglot.model.clock import RealClock
from roboglot.values import dataclass

ADDRESSES_MAX = 4096
AT_ONCE_MAX = 64
PROBE_SECONDS = 1.0
SLAMWARE_HOTSPOT = "192.168.11.1"  # a Slamware robot's address in its own network
CYBERDOG_PORT = 50052


@dataclass(frozen=True, slots=True)
class FoundRobot:
    """A robot: its URL, and its own description."""

    url: str
    words: str


def command(
    addresses: Annotated[
        list[str] | None,
        typer.Argument(help="Addresses or networks (10.0.0.0/24) to probe; RoboMasters broadcast by themselves."),
    ] = None,
    seconds: Annotated[
        float, typer.Option(min=0, max=600, callback=finite, help="Seconds to listen for RoboMasters.")
    ] = 3.0,
) -> None:
    """Find robots on the network."""
    try:
        hosts = list(dict.fromkeys(expand(addresses or [SLAMWARE_HOTSPOT])))
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    found = asyncio.run(_scan(hosts, seconds))
    if not found:
        print("no robot answered")
        raise typer.Exit(1)
    from roboglot.cli.screen import as_typed

    line = as_typed(f"roboglot up --robot {shlex.quote(f'b={found[0].url}')}")
    print(f"\nconnect with, for example:  {line}")


def expand(texts: Iterable[str]) -> Iterable[str]:
    """Yield every address of addresses and networks. Raises ValueError beyond ADDRESSES_MAX."""
    count = 0
    for text in texts:
        network = ip_network(text, strict=False)
        count += network.num_addresses
        if count > ADDRESSES_MAX:
            raise ValueError(f"more than {ADDRESSES_MAX} addresses")
        yield from ([str(ip_address(text))] if "/" not in text else (str(host) for host in network.hosts()))


async def _scan(hosts: list[str], seconds: float) -> list[FoundRobot]:
    """Print each robot as soon as it answers."""
    found = []
    async for robot in find(hosts, seconds):
        quoted = shlex.quote(robot.url)  # a shell takes the ? of a URL for a pattern
        print(in_line(f"{quoted:40} {robot.words}"), flush=True)
        found.append(robot)
    return found


async def find(hosts: list[str], seconds: float) -> AsyncIterator[FoundRobot]:
    """Yield robots as they answer."""
    turns = asyncio.Semaphore(AT_ONCE_MAX)

    async def ask(probe: Callable[[str], Awaitable[FoundRobot | None]], host: str) -> list[FoundRobot]:
        async with turns:
            one = await probe(host)
            return [one] if one else []

    work = [ask(probe, host) for host in hosts for probe in (slamware_at, cyberdog_at)]
    for answer in asyncio.as_completed([_robomasters(seconds), *work]):
        for one in await answer:
            yield one


async def _robomasters(seconds: float) -> list[FoundRobot]:
    try:
        heard = await discover(seconds)
    except ClientError as error:
        print(f"cannot listen for RoboMasters: {error}", file=sys.stderr)
        return []
    return [FoundRobot(f"robomaster://{address}", "DJI RoboMaster EP, free") for address in heard]


async def slamware_at(host: str, port: int = 1448) -> FoundRobot | None:
    """Probe for a Slamware robot by its name plate."""
    async with SlamwareClient(host, port, clock=RealClock(), timeout=PROBE_SECONDS) as client:
        try:
            plate = await client.get_robot_info()
        except ClientError:
            return None
    where = f"slamware://{host}" + (f":{port}" if port != 1448 else "")
    return FoundRobot(
        where, f"{plate.manufacturer_name} {plate.model_name} {plate.software_version}, {plate.device_id}"
    )


async def cyberdog_at(host: str, port: int = CYBERDOG_PORT) -> FoundRobot | None:
    """Probe for a CyberDog by its certificate; a connection needs one of the same authority."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # read without verification
    context.set_alpn_protocols(["h2"])
    try:
        async with asyncio.timeout(PROBE_SECONDS):
            _, writer = await asyncio.open_connection(host, port, ssl=context)
    except (OSError, TimeoutError):
        return None
    try:
        data = writer.get_extra_info("ssl_object").getpeercert(binary_form=True)
    finally:
        writer.transport.abort()
    words = "CyberDog 2"
    with contextlib.suppress(ValueError, ImportError):
        from cryptography import x509

        words = f"CyberDog 2 {x509.load_der_x509_certificate(data).subject.rfc4514_string()}"
    where = f"cyberdog://{host}" + (f":{port}" if port != CYBERDOG_PORT else "")
    return FoundRobot(f"{where}?certs=DIR", words)
