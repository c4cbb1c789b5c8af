"""``roboglot stop``: cancels all actions of a robot of a running ``roboglot up``, which brakes."""

from __future__ import annotations

from typing import Annotated

import typer

from roboglot.cli.control.lease import Data, send
from roboglot.control.lease_server import Request


def command(
    robot: Annotated[str, typer.Argument(help="The robot's name.")] = "",
    all_: Annotated[bool, typer.Option("--all", help="Stop all robots at once.")] = False,
    data: Data = None,
) -> None:
    """Stop a robot, or all. Programs and clients may move them again: `roboglot lease` keeps them standing.

    Delivery orders wait until *Go on* in the console.
    """
    if bool(robot) == all_:
        raise typer.BadParameter("name a robot, or give --all")
    answer = send("stop", Request("stop", robot, all=all_), data)
    count = len(answer.robots)
    print(f"{count} robots stand" if all_ and count > 1 else f"{robot or answer.robots[0].robot} stands")
    if any(not each.taken_by for each in answer.robots if robot in ("", each.robot)):
        lease = f"roboglot lease {robot or '--all'} --take"
        print(f"Programs and clients go on, and may move {'it' if robot else 'them'} again: `{lease}` prevents that.")
