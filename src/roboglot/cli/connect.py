"""``roboglot connect``: a robot behind a gateway as if it were on this machine, for unmodified clients."""

from __future__ import annotations

import asyncio
import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from roboglot.access.tunnel.connector import Connector, KnownGateways, NotTrusted, Refused
from roboglot.cli.screen import set_up_logging

PORT = 50090
AGAIN_AFTER = 1.0  # s


def command(
    gateway: Annotated[str, typer.Argument(help="HOST or HOST:PORT of the robots' gateway ([access] gateway there).")],
    robot: Annotated[str, typer.Option(help="Its name there.")] = "a",
    token_file: Annotated[Path | None, typer.Option(help="A file with the token; else ROBOGLOT_TOKEN.")] = None,
    address: Annotated[str, typer.Option(help="Of this machine's loopback, where the robot is to be.")] = "127.0.0.1",
    once: Annotated[bool, typer.Option("--once", help="End when the tunnel is lost.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log every connection.")] = False,
) -> None:
    """Open the robot's vendor ports here, and carry them over one TLS connection to the gateway."""
    set_up_logging(verbose)
    host, _, port = gateway.rpartition(":") if gateway.rpartition(":")[2].isdigit() else (gateway, "", str(PORT))
    try:
        token = token_file.read_text() if token_file else os.environ.get("ROBOGLOT_TOKEN", "")
    except OSError as error:
        sys.exit(f"roboglot connect: {error}")
    if not token.strip():
        sys.exit("roboglot connect: a token is needed: --token-file FILE, or ROBOGLOT_TOKEN")
    known = KnownGateways(_settings() / "gateways.json")
    connector = Connector(host.strip("[]"), int(port), robot, token.strip(), address, known)
    try:
        asyncio.run(_keep(connector, address, once))
    except KeyboardInterrupt:
        sys.exit(130)
    except (NotTrusted, Refused) as refused:
        sys.exit(f"roboglot connect: {refused}")


async def _keep(connector: Connector, address: str, once: bool) -> None:
    """Dial again whenever the tunnel is lost."""

    def ready(ports: list[int], fingerprint: str, new: bool) -> None:
        first = "; seen for the first time: compare it with `roboglot doctor` there" if new else ""
        print(f"gateway {fingerprint}{first}", file=sys.stderr)
        print(f"ready: {address}, ports {', '.join(map(str, ports))}", flush=True)

    while True:
        try:
            await connector.run(ready)
        except (NotTrusted, Refused):
            raise
        except (OSError, TimeoutError, asyncio.IncompleteReadError) as error:
            print(f"roboglot connect: {error or type(error).__name__}", file=sys.stderr)
        if once:
            return
        await asyncio.sleep(AGAIN_AFTER)


def _settings() -> Path:
    home = Path(os.environ.get("HOME", "/tmp"))
    return Path(os.environ.get("XDG_CONFIG_HOME") or home / ".config") / "roboglot"
