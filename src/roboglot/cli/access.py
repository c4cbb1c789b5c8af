"""``roboglot access``: who may do what with which robot. A running program acts on every change within a second."""

from __future__ import annotations

import getpass
import re
import sqlite3
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path
from typing import Annotated

import typer

from roboglot.access.rights import ALL_ROBOTS, parse_rights, write_rights
from roboglot.access.store import AccessStore, Grant, IdentityKind, open_store
from roboglot.cli.suggestions import Group
from roboglot.config import Config
from roboglot.hosting.error_text import in_words
from roboglot.storage.transactions import FAILURES

app = typer.Typer(
    cls=Group,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Give people, machines and apps rights to robots, or revoke them.",
)
UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}

Data = Annotated[Path | None, typer.Option(envvar="ROBOGLOT_DATA", help="Folder of the robots' data.")]
Database = Annotated[
    str, typer.Option(envvar="ROBOGLOT_DATABASE", help="postgresql://host/name, instead of the data folder.")
]
Name = Annotated[str, typer.Argument(help="The account's name, without blanks.")]
Rights = Annotated[str, typer.Option(help="see, drive, program, edit, admin; separate several by commas.")]
Robots = Annotated[str, typer.Option(help="Names of robots, separated by commas; *: all.")]
Until = Annotated[str, typer.Option(help="End of the rights: 18:00, or 2027-01-31T18:00.")]
For = Annotated[str, typer.Option("--for", help="Duration of the rights: 2h, 45min, 30d.")]


@app.command()
def add(
    name: Name,
    rights: Rights = "see",
    robots: Robots = ALL_ROBOTS,
    until: Until = "",
    lasts: For = "",
    person: Annotated[bool, typer.Option("--person", help="For a person; asks for a password.")] = False,
    cyberdog: Annotated[
        Path | None, typer.Option(help="For a CyberDog app; writes its certificate to this folder.")
    ] = None,
    data: Data = None,
    database: Database = "",
) -> None:
    """Add an account; print a machine's token, which cannot be shown again."""
    with _store(data, database) as store:
        grants = _grants(rights, robots, until, lasts)
        if person:
            store.add_person(name, _password(), grants)
        elif cyberdog is not None:
            from roboglot.protocols.cyberdog.certificates import export_app
            from roboglot.protocols.cyberdog.pem_files import FOLDER

            for path in export_app(_folder(data) / FOLDER, name, cyberdog):
                print(path)
            store.add_app(name, grants)
        else:
            print(store.add_machine(name, grants))


@app.command()
def allow(
    address: Annotated[str, typer.Argument(help="Address of the client's machine, such as 10.0.0.7.")],
    robot: Annotated[str, typer.Argument(help="Name of the robot; *: all robots.")],
    rights: Rights = "drive",
    until: Until = "",
    lasts: For = "",
    data: Data = None,
    database: Database = "",
) -> None:
    """Give rights to an address, for clients that can show neither a token nor a certificate."""
    with _store(data, database) as store:
        store.allow(address, _grants(rights, robot, until, lasts))


@app.command()
def revoke(name: Name, data: Data = None, database: Database = "") -> None:
    """Remove an account; its robots' actions end."""
    with _store(data, database) as store:
        store.revoke(name)


@app.command()
def rotate(name: Name, data: Data = None, database: Database = "") -> None:
    """Give a machine another token, or a person another password; the old one is no longer valid."""
    with _store(data, database) as store:
        person = any(entry.name == name and entry.kind is IdentityKind.PERSON for entry in store.identities())
        if token := store.rotate(name, _password() if person else ""):
            print(token)


@app.command(name="list")
def list_all(data: Data = None, database: Database = "") -> None:
    """List accounts and addresses with their rights."""
    from rich.console import Console
    from rich.table import Table

    table = Table("name", "kind", "robot", "rights", "until")
    with _store(data, database) as store:
        for identity in store.identities():
            for grant in identity.grants or (Grant("-", frozenset()),):
                until = datetime.fromtimestamp(grant.until).astimezone() if grant.until else None
                end = f"{until:%Y-%m-%d %H:%M}" if until else ""
                table.add_row(identity.name, identity.kind, grant.robot, write_rights(grant.rights), end)
    Console().print(table)


@app.command()
def copy(
    database: Annotated[
        str, typer.Option(envvar="ROBOGLOT_DATABASE", help="The server to copy to: postgresql://host/name.")
    ],
    data: Data = None,
) -> None:
    """Copy the list of a data folder to a PostgreSQL server; names that the server already has are not changed."""
    if not database:
        sys.exit("roboglot access: to which --database?")
    with _store(data, "") as source, _store(None, database) as target:
        there = {identity.name for identity in target.identities()}
        missing = [identity for identity in source.identities() if identity.name not in there]
        for identity in missing:
            target.put(identity)
    print(f"{len(missing)} copied, {len(there)} were there")


def _grants(rights: str, robots: str, until: str, lasts: str) -> list[Grant]:
    chosen, end = parse_rights(rights), _end(until, lasts)
    return [Grant(robot.strip(), chosen, end) for robot in robots.split(",") if robot.strip()]


def _end(until: str, lasts: str) -> float | None:
    """Return the end of a right (Unix s); None: unlimited. Raises ValueError, also for an end that is past."""
    now = datetime.now().astimezone()
    if until and lasts:
        raise ValueError("give either --until or --for")
    if not until and not lasts:
        return None
    try:
        end = _after(lasts, now) if lasts else _moment(until, now).timestamp()
    except OverflowError:
        raise ValueError(f"{until or lasts!r} is beyond the year 9999") from None
    if end <= now.timestamp():
        raise ValueError(f"the rights would end at once: {until or lasts!r} is not in the future")
    return end


def _after(lasts: str, now: datetime) -> float:
    """Return the end of a duration that begins now. Raises ValueError."""
    match = re.fullmatch(r"(\d{1,6})\s*(s|min|h|d)", lasts, re.ASCII)
    if match is None:
        raise ValueError(f"--for is a time such as 2h, 45min or 30d, not {lasts!r}")
    return (now + timedelta(seconds=int(match[1]) * UNITS[match[2]])).timestamp()


def _moment(until: str, now: datetime) -> datetime:
    """Return a moment by the clock of this machine: today's or tomorrow's, if no day is given. Raises ValueError."""
    try:
        if not re.fullmatch(r"\d{1,2}:\d{2}", until, re.ASCII):
            return datetime.fromisoformat(until).astimezone()
        clock = datetime.strptime(until, "%H:%M").time()  # noqa: DTZ007 - of the day, here
    except ValueError:
        raise ValueError(f"--until is 18:00 or 2027-01-31T18:00, not {until!r}") from None
    today = datetime.combine(now.date(), clock).astimezone()
    return today if today > now else datetime.combine(now.date() + timedelta(days=1), clock).astimezone()


def _password() -> str:
    """Return a password, typed on the terminal or the first line of a pipe. Raises ValueError."""
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\n")
    first, again = getpass.getpass("password: "), getpass.getpass("the same again: ")
    if first != again:
        raise ValueError("the two passwords differ")
    return first


def _folder(data: Path | None) -> Path:
    return data or Config().data


@contextmanager
def _store(data: Path | None, database: str) -> Iterator[AccessStore]:
    """Context with the list of identities; errors end the program with one line."""
    try:
        store = open_store(_folder(data), database)
        try:
            yield store
        finally:
            store.close()
    except (ValueError, LookupError, OSError, sqlite3.Error, *FAILURES) as error:
        words = in_words(error) if isinstance(error, OSError) or not error.args else error.args[-1]
        sys.exit(f"roboglot access: {words}")
