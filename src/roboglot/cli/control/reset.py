"""``roboglot reset``: returns a simulated robot of a running ``roboglot up`` to its start."""

from __future__ import annotations

from typing import Annotated

import typer

from roboglot.cli.control.lease import Data, send
from roboglot.control.lease_server import Request


def command(robot: Annotated[str, typer.Argument(help="The robot's name.")], data: Data = None) -> None:
    """Stop a robot, put it where it started, charge it, end its faults. What it knows and has stored stays."""
    send("reset", Request("reset", robot), data)
    print(f"{robot} is back where it started")
