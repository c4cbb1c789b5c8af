"""``roboglot lease``: who moves each robot of a running ``roboglot up``; takes control, gives it, releases it."""

from __future__ import annotations

import asyncio
import os
import sys
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from roboglot.config import default_data_folder
from roboglot.hosting.local_socket import ask
from roboglot.protocols.lease_desk import NAME, Answer, Control, Request

PATIENCE = 10.0  # s until the robot should have braked


def command(
    robot: Annotated[str, typer.Argument(help="Its name, for all but looking.")] = "",
    take: Annotated[bool, typer.Option("--take", help="No client moves it until control is released.")] = False,
    give: Annotated[
        str, typer.Option(metavar="WHO", help="Only this door or client moves it: robomaster, 'slamware 10.0.0.7'.")
    ] = "",
    release: Annotated[bool, typer.Option("--release", help="Let any client move it again.")] = False,
    data: Annotated[
        Path | None, typer.Option(envvar="ROBOGLOT_DATA", help="The folder that `roboglot up` uses.")
    ] = None,
) -> None:
    """Show who moves each robot; take control of one, pass it on or release it."""
    if take + bool(give) + release > 1:
        raise typer.BadParameter("one of --take, --give and --release")
    if (take or give or release) and not robot:
        raise typer.BadParameter("which robot?")
    wish = Request("take" if take else "give" if give else "release" if release else "look", robot, give)
    folder = data or default_data_folder(os.environ)
    try:
        answer = asyncio.run(_ask(folder / NAME, wish))
    except OSError as error:
        sys.exit(f"roboglot lease: no `roboglot up` answers in {folder}: {error.strerror or 'it takes too long'}")
    if answer.error:
        sys.exit(f"roboglot lease: {answer.error}")
    shown = [control for control in answer.robots if robot in ("", control.robot)]
    if not shown:
        sys.exit(f"roboglot lease: there is no robot {robot!r}; there are {', '.join(c.robot for c in answer.robots)}")
    for control in shown:
        print(in_words(control))


async def _ask(path: Path, wish: Request) -> Answer:
    """TimeoutError if the robot does not brake in time; it is an OSError, as all others."""
    line = await ask(path, msgspec.json.encode(wish), PATIENCE)
    try:
        return msgspec.json.decode(line, type=Answer)
    except msgspec.DecodeError:
        raise OSError(0, "it hung up") from None


def in_words(control: Control) -> str:
    """A line of the table."""
    if control.holder:
        moved = f"moved by {control.holder}" + (f" ({control.doing}" if control.doing else " (")
        moved += f"{' ' if control.doing else ''}for {control.seconds:.0f} s)"
    else:
        moved = f"moved by no client, last by {control.last}" if control.last else "moved by no client yet"
    whose = f"control is taken by {control.taken_by}" if control.taken_by else "control is free"
    return f"{control.robot:8} {moved}; {whose}" + (f"; link {control.link}" if control.link else "")
