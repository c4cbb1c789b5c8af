"""``roboglot lease``: who moves each robot of a running ``roboglot up``; takes control, gives it, releases it."""

from __future__ import annotations

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated, Literal

import typer

from roboglot.cli.control import running
from roboglot.config import default_data_folder
from roboglot.control.lease_server import NAME, Answer, Control, Request
from roboglot.hosting.escaping import in_line
from roboglot.spelling import instead

PATIENCE = 10.0  # s to wait until the robot has braked
Data = Annotated[
    Path | None, typer.Option(envvar="ROBOGLOT_DATA", help="The folder that `roboglot up` or `roboglot fleet up` uses.")
]
Verb = Literal["look", "take", "give", "release"]


def command(
    robot: Annotated[str, typer.Argument(help="The robot's name; without it, show all.")] = "",
    take: Annotated[
        bool, typer.Option("--take", help="Take control: no client moves the robot until it is released.")
    ] = False,
    give: Annotated[
        str | None,
        typer.Option(metavar="WHO", help="Give control to this door or client alone: robomaster, 'slamware 10.0.0.7'."),
    ] = None,
    release: Annotated[
        bool, typer.Option("--release", help="Release control: any client may move the robot again.")
    ] = False,
    all_: Annotated[bool, typer.Option("--all", help="Take, give or release control of all robots.")] = False,
    data: Data = None,
) -> None:
    """Show who moves each robot; take control of one, pass it on or release it."""
    given: dict[Verb, bool] = {"take": take, "give": give is not None, "release": release}
    verbs: list[Verb] = [verb for verb, is_given in given.items() if is_given]
    if len(verbs) > 1:
        raise typer.BadParameter("give one of --take, --give and --release")
    if (robot and all_) or (verbs and not robot and not all_):
        raise typer.BadParameter("name a robot, or give --all")
    verb: Verb = verbs[0] if verbs else "look"
    answer = send("lease", Request(verb, robot, give or "", all_), data)
    shown = [control for control in answer.robots if robot in ("", control.robot)]
    if not shown:
        sys.exit(f"roboglot lease: there is no robot {robot!r}{instead(robot, _names(answer))}")
    for control in shown:
        print(in_line(in_words(control)))


def send(command: str, request: Request, data: Path | None) -> Answer:
    """Return the answer of the running `roboglot up`, or of all worlds if the folder is a fleet's.

    Without an answer, end the program with a sentence.
    """
    folder = data or default_data_folder(os.environ)
    worlds = sorted(folder.glob(f"shards/*/data/{NAME}"), key=lambda path: (len(path.parts[-3]), path))
    if not worlds or (folder / NAME).exists():
        return running.request(command, folder / NAME, request, Answer, PATIENCE)
    if request.robot:
        answers, refused = _together(command, worlds, Request())
        homes = {name: world for world, answer in answers.items() for name in _names(answer)}
        if request.robot not in homes:
            refused.append(f"roboglot {command}: there is no robot {request.robot!r}{instead(request.robot, homes)}")
            sys.exit("\n".join(refused))
        worlds = [homes[request.robot]]
    answers, refused = _together(command, worlds, request)
    if refused:
        sys.exit("\n".join(refused))
    return Answer([control for answer in answers.values() for control in answer.robots])


def _together(command: str, worlds: list[Path], request: Request) -> tuple[dict[Path, Answer], list[str]]:
    """Return the answers of the worlds, and the sentences of those that refuse or do not answer."""
    answers, refused = dict[Path, Answer](), list[str]()
    with ThreadPoolExecutor(len(worlds)) as together:
        asked = {w: together.submit(running.request, command, w, request, Answer, PATIENCE) for w in worlds}
    for world, end in asked.items():
        try:
            answers[world] = end.result()
        except SystemExit as sentence:
            refused.append(str(sentence.code))
    return answers, refused


def _names(answer: Answer) -> list[str]:
    return [control.robot for control in answer.robots]


def in_words(control: Control) -> str:
    """Return a line of the table."""
    if control.holder:
        moved = f"moved by {control.holder}" + (f" ({control.doing}" if control.doing else " (")
        moved += f"{' ' if control.doing else ''}for {control.seconds:.0f} s)"
    else:
        moved = f"moved by no client, last by {control.last}" if control.last else "moved by no client yet"
    whose = f"control is taken by {control.taken_by}" if control.taken_by else "control is free"
    return f"{control.robot:8} {moved}; {whose}" + (f"; link {control.link}" if control.link else "")
