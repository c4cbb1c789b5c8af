"""Terminal output: the start screen and log lines."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence

from rich.console import Console
from rich.markup import escape

from roboglot.cli.visible import VisibleFormatter
from roboglot.config import Config
from roboglot.model.client_context import concerned
from roboglot.protocols.door import Endpoint

NOISY = ("uvicorn", "websockets", "httpx", "grpc", "asyncio", "numba")


class NamesRobot(logging.Filter):
    """Puts the robot's name before a line about one that does not name it."""

    def filter(self, record: logging.LogRecord) -> bool:
        if (robot := concerned()) and (name := f"robot {robot}") not in (text := record.getMessage()):
            record.msg, record.args = f"{name}: {text}", None
        return True


def set_up_logging(verbose: bool) -> None:
    """One readable line per event, on standard error."""
    handler = logging.StreamHandler()
    handler.setFormatter(VisibleFormatter("%(asctime)s %(levelname)-7s %(message)s  (%(name)s)", "%H:%M:%S"))
    handler.addFilter(NamesRobot())
    logging.basicConfig(level=logging.DEBUG if verbose else logging.INFO, handlers=[handler])
    for name in NOISY:
        logging.getLogger(name).setLevel(logging.INFO if verbose else logging.WARNING)


def warn_if_open(config: Config) -> None:
    """Say in red, on standard error, what is open to whom; nothing for robots on loopback, or that ask who comes."""
    if config.access.on:
        return
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    for robot in config.opened:
        everywhere = robot.address in ("0.0.0.0", "::")
        where = "every network of this machine" if everywhere else f"the network of {robot.address}"
        console.print(
            f"[bold red]INSECURE[/][red]: robot {robot.name} is open to everyone on {where}: anyone there may drive it,"
            " see and hear through it, run programs on it and change its maps and settings (Slamware REST, RoboMaster"
            " text, block programs; CyberDog gRPC asks for a certificate of the data folder)[/]"
        )


def announce(config: Config, endpoints: Mapping[str, Sequence[Endpoint]], page: str = "") -> None:
    """Every door's address and one line to copy that tries it, and the console's ``page``; no line is broken."""
    console = Console(highlight=False, soft_wrap=True)
    pace = "lockstep: type seconds" if config.lockstep else f"x{config.speed:g}"
    console.print(f"[bold]roboglot[/]  world {config.world} · clock {pace} · data {escape(str(config.data))}")
    for robot in config.robots:
        console.print(f"\nrobot [bold]{robot.name}[/] ({robot.body}) on {robot.address}")
        for endpoint in endpoints[robot.name]:
            console.print(f"  [cyan]{endpoint.label:22}[/] {endpoint.address}")
            if endpoint.try_line:
                console.print(f"    [dim]{escape(endpoint.try_line)}[/]")
    if page:
        console.print(f"\n[bold]console[/]  [link={page}]{page}[/]  [dim]see and drive every robot in a browser[/]")
    console.print()
