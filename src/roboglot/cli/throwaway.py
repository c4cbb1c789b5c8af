"""Runs a command of uvx or pipx, which install nothing permanently, again with the extra that it needs.

Permanent environments are left alone; there one sentence says what to install.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import NoReturn

AGAIN = "ROBOGLOT_RUN_AGAIN"  # set for the second run, which is the last


def runner() -> list[str]:
    """Return the command that runs roboglot from a requirement, its last argument; empty if there is none."""
    if AGAIN in os.environ:
        return []
    uv = os.environ.get("UV", "")  # uv sets this for its child processes
    if uv and Path(sys.prefix).parent.name.startswith(("archive-", "environments-")):
        return [uv, "tool", "run", "--from"]
    pipx = shutil.which("pipx")
    if pipx and "pipx" in Path(sys.prefix).parts and ".cache" in Path(sys.prefix).parts:
        return [pipx, "run", "--spec"]
    return []


def requirement(extra: str) -> str:
    """Return this roboglot with an extra as a requirement: by its source of installation, else by its version."""
    try:
        here = distribution("roboglot")
    except PackageNotFoundError:
        return f"roboglot[{extra}]"
    origin = json.loads(here.read_text("direct_url.json") or "{}").get("url")
    return f"roboglot[{extra}] @ {origin}" if origin else f"roboglot[{extra}]=={here.version}"


def run_again(command: list[str], extra: str, arguments: list[str]) -> NoReturn:
    """Replace this process by ``command`` with ``extra`` and roboglot's ``arguments``. Raises OSError."""
    wanted = requirement(extra)
    print(f"roboglot: running again with {wanted}, which is fetched once", file=sys.stderr, flush=True)
    os.environ[AGAIN] = "1"
    os.execv(command[0], [*command, wanted, "roboglot", *arguments])
