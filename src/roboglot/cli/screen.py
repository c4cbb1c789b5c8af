"""Terminal output: the start screen and the warning of open doors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.console import Console
from rich.markup import escape

from roboglot.config import Config
from roboglot.protocols import DOORS
from roboglot.protocols.door import Endpoint


def warn_if_open(config: Config) -> None:
    """Warn in red, on standard error, of open doors; not for robots on loopback or with access control."""
    if config.access.on:
        return
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    for robot in config.opened:
        everywhere = robot.address in ("0.0.0.0", "::")
        where = "every network of this machine" if everywhere else f"the network of {robot.address}"
        console.print(
            f"[bold red]INSECURE[/][red]: robot {robot.name} is open to everyone on {where}: anyone there may drive it,"
            f" see and hear through it, run programs on it and change its maps and settings ({_open_doors(config)})[/]"
        )


def _open_doors(config: Config) -> str:
    """Name the doors that obey all clients, and those that demand something by themselves."""
    listening = [door for door in DOORS if door.listens(config)]
    asking = [f"{door.title} asks for {door.asks}" for door in listening if door.asks]
    return "; ".join([", ".join(door.title for door in listening if not door.asks), *asking])


def announce(config: Config, endpoints: Mapping[str, Sequence[Endpoint]], page: str = "") -> None:
    """Print every door's address with a line that tries it, and the console's ``page``; lines are not wrapped."""
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
    if config.access.on and config.access.gateway:
        from roboglot.protocols.cyberdog.certificates import SERVER_CERT, fingerprint
        from roboglot.protocols.cyberdog.server import FOLDER

        shown = fingerprint(config.data / FOLDER / "tls" / SERVER_CERT)
        console.print(f"\n[bold]gateway[/]  {config.access.gateway}  [dim]for `roboglot connect`; SHA-256 {shown}[/]")
    console.print()
