"""``roboglot audit``: who changed what with which robot, and what was refused."""

from __future__ import annotations

import sqlite3
import sys
import time
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from roboglot.access.trail import FILE, Entry, Trail, open_trail
from roboglot.config import Config
from roboglot.hosting.error_text import in_words
from roboglot.hosting.escaping import in_line
from roboglot.storage.transactions import FAILURES

LOOK_PERIOD = 0.5  # s


def command(
    robot: Annotated[str, typer.Option(help="Only rows of this robot.")] = "",
    follow: Annotated[bool, typer.Option("--follow", "-f", help="Also print new rows as they come.")] = False,
    check: Annotated[bool, typer.Option("--verify", help="Check that no row was changed or removed.")] = False,
    data: Annotated[Path | None, typer.Option(envvar="ROBOGLOT_DATA", help="Folder of the robots' data.")] = None,
    database: Annotated[
        str, typer.Option(envvar="ROBOGLOT_DATABASE", help="postgresql://host/name, instead of the data folder.")
    ] = "",
) -> None:
    """Print the rows of the audit, oldest first; it is written with access control (--access)."""
    folder = data or Config().data
    if not database and not (folder / FILE).exists():
        sys.exit(f"roboglot audit: there is none in {folder}: robots keep one with --access")
    try:
        with open_trail(folder, database) as trail:
            if check:
                count, digest = trail.verify()
                print(f"{count} rows are intact; keep this elsewhere to detect rows cut off later: {count} {digest}")
                return
            last = _print(trail, robot, 0)
            while follow:
                time.sleep(LOOK_PERIOD)
                last = _print(trail, robot, last)
    except (ValueError, OSError, sqlite3.Error, *FAILURES) as error:
        sys.exit(f"roboglot audit: {in_words(error)}")


def _print(trail: Trail, robot: str, after: int) -> int:
    """Print the rows after number ``after``; return the number of the last."""
    for number, entry in trail.rows(robot=robot, after=after):
        print(_line(number, entry), flush=True)
        after = number
    return after


def _line(number: int, entry: Entry) -> str:
    when = f"{datetime.fromtimestamp(entry.at).astimezone():%Y-%m-%d %H:%M:%S}"
    parts = (entry.robot, entry.door, entry.who, entry.address, entry.operation)
    again = f" (and {entry.repeats} times before)" if entry.repeats else ""
    reason = f": {entry.reason}" if entry.reason else ""
    return in_line(f"{number} {when} {' '.join(part or '-' for part in parts)} {entry.outcome}{reason}{again}")
