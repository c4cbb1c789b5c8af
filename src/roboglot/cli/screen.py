"""Terminal output: the start screen and the warning of open doors."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import typer

from roboglot.config import Config
from roboglot.protocols import DOORS
from roboglot.protocols.door import Endpoint


def warn_if_open(config: Config) -> None:
    """Warn in red, on standard error, of open doors; not for robots on loopback or with access control."""
    if config.access.on:
        return
    for robot in config.exposed:
        everywhere = robot.address in ("0.0.0.0", "::")
        where = "every network of this machine" if everywhere else f"the network of {robot.address}"
        danger = typer.style("INSECURE", fg="red", bold=True)
        why = typer.style(
            f": robot {robot.name} is open to everyone on {where}: anyone there may drive it, see and hear through it,"
            f" run programs on it and change its maps and settings ({_open_doors(config)})",
            fg="red",
        )
        _print(danger + why, to_errors=True)


def _open_doors(config: Config) -> str:
    """Name the doors that obey all clients, and those that demand something by themselves."""
    listening = [door for door in DOORS if door.listens(config)]
    asking = [f"{door.title} asks for {door.credentials}" for door in listening if door.credentials]
    return "; ".join([", ".join(door.title for door in listening if not door.credentials), *asking])


def announce(config: Config, endpoints: Mapping[str, Sequence[Endpoint]], page: str = "") -> None:
    """Print every door's address with a line that tries it, and the console's ``page``; lines are not wrapped."""
    pace = "lockstep: type seconds" if config.lockstep else f"x{config.speed:g}"
    _print(f"{_bold('roboglot')}  world {config.world} · clock {pace} · data {config.data}")
    for robot in config.robots:
        _print(f"\nrobot {_bold(robot.name)} ({robot.body}) on {robot.address}")
        for endpoint in endpoints[robot.name]:
            _print(f"  {typer.style(f'{endpoint.label:22}', fg='cyan')} {endpoint.address}")
            if endpoint.try_line:
                _print(f"    {_dim(as_typed(endpoint.try_line))}")
    if page:
        _print(f"\n{_bold('console')}  {page}  {_dim('see and drive every robot in a browser')}")
    if config.access.on and config.access.gateway:
        from roboglot.protocols.cyberdog.pem_files import FOLDER, SERVER_CERT
        from roboglot.protocols.cyberdog.signing import fingerprint

        shown = fingerprint(config.data / FOLDER / "tls" / SERVER_CERT)
        _print(f"\n{_bold('gateway')}  {config.access.gateway}  {_dim(f'for `roboglot connect`; SHA-256 {shown}')}")
    _print("")


def as_typed(line: str) -> str:
    """Return a command line with the path of this program where the shell does not find it by its name."""
    program, space, arguments = line.partition(" ")
    path = Path(sys.executable).with_name("roboglot")
    if program != "roboglot" or shutil.which(program) or not path.exists():
        return line
    typed = os.path.relpath(path) if path.is_relative_to(Path.cwd()) else str(path)
    return f"{shlex.quote(typed)}{space}{arguments}"


def shortened(text: str, most: int) -> str:
    """Return the text in at most so many characters, cut between words where that keeps half of them."""
    if len(text) <= most:
        return text
    kept = text[: most - 1]  # the space before the ellipsis included
    words = kept[: kept.rfind(" ")].rstrip() if kept.rfind(" ") >= most // 2 else kept[: most - 2]
    return f"{words} …"


def _bold(text: str) -> str:
    return typer.style(text, bold=True)


def _dim(text: str) -> str:
    return typer.style(text, dim=True)


def _print(text: str, *, to_errors: bool = False) -> None:
    """Print a line, with its styles on a terminal; NO_COLOR and FORCE_COLOR override that, in this order."""
    styled = False if os.environ.get("NO_COLOR") else True if os.environ.get("FORCE_COLOR") else None
    typer.echo(text, err=to_errors, color=styled)
