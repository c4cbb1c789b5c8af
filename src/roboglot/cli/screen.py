"""What people see: the start screen and log lines."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence

from rich.console import Console
from rich.table import Table

from roboglot.config import Config
from roboglot.protocols.door import Door

NOISY = ("uvicorn", "httpx", "grpc", "asyncio", "numba")


def set_up_logging(verbose: bool) -> None:
    """One readable line per event, on standard error."""
    logging.basicConfig(
        level=logging.DEBUG if verbose else logging.INFO,
        format="%(asctime)s %(levelname)-7s %(message)s  (%(name)s)",
        datefmt="%H:%M:%S",
    )
    for name in NOISY:
        logging.getLogger(name).setLevel(logging.INFO if verbose else logging.WARNING)


def announce(config: Config, doors: Mapping[str, Sequence[Door]]) -> None:
    """Every door's address and one line to copy that tries it."""
    console = Console(soft_wrap=True)
    pace = "lockstep: type seconds" if config.lockstep else f"x{config.speed:g}"
    console.print(f"[bold]roboglot[/]  world {config.world} · clock {pace} · data {config.data}", highlight=False)
    for robot in config.robots:
        table = Table(box=None, pad_edge=False, show_header=False, padding=(0, 2, 0, 2))
        for endpoint in (e for door in doors[robot.name] for e in door.endpoints):
            table.add_row(f"[cyan]{endpoint.label}[/]", endpoint.address)
            if endpoint.try_line:
                table.add_row("", f"[dim]{endpoint.try_line}[/]")
        console.print(f"\nrobot [bold]{robot.name}[/] ({robot.body}) on {robot.address}", highlight=False)
        console.print(table, highlight=False)
    console.print()
