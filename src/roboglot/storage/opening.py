"""Opens the database of a configuration: a file, or a PostgreSQL server by its URL."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection
from contextlib import closing
from pathlib import Path

from roboglot.extras import explained
from roboglot.storage.database import ROBOTS, Database
from roboglot.storage.transactions import Transactions


def open_registry(where: str) -> Transactions:
    """Open the registry of robots: a server's URL, or a file. Raises the errors of ``open_database``."""
    return open_database(Path(), where) if "://" in where else open_database(Path(where))


def read_registry(where: str) -> Transactions:
    """Open the registry read-only; on a server, a role that may read the table ``robot_home`` suffices.

    Raises the errors of ``open_database``, and OSError for a file that is missing or no registry.
    """
    if "://" in where:
        return open_database(Path(), where, only_read=True)
    if not Path(where).is_file():
        raise OSError(f"there is no file {where}")
    if not _has_robots(Path(where)):
        raise OSError(f"{where} is not a registry of robots")
    return open_database(Path(where))


def _has_robots(file: Path) -> bool:
    """Return whether a file is a registry; another program's is not changed. Raises OSError if it cannot be read."""
    try:
        with closing(sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro", uri=True)) as found:
            return bool(found.execute("SELECT 1 FROM sqlite_master WHERE name='robot_home'").fetchall())
    except sqlite3.OperationalError as error:
        raise OSError(f"{file} cannot be read: {error}") from None
    except sqlite3.DatabaseError:  # it is no database
        return False


def open_private(file: Path, schema: str, url: str = "") -> Transactions:
    """Open a separate ``file`` that only its owner may read, or the server with the same tables.

    Raises the errors of ``open_database``.
    """
    if not url:
        file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        file.touch(mode=0o600)
    return open_database(file, url, schema=schema)


def open_database(
    file: Path,
    url: str = "",
    robots: Collection[str] = (),
    *,
    in_place: bool = False,
    only_read: bool = False,
    schema: str = ROBOTS,
) -> Transactions:
    """Open PostgreSQL by its ``url``, or without one the ``file`` with the tables of ``schema``.

    ``robots``: only this program writes their data, in the order of its calls. ``only_read``: a server's tables are not
    migrated, and cannot be written. Raises ValueError for another kind of URL or a database of a newer program; OSError
    if the server or its driver is missing or a robot is taken; sqlite3.Error for a file that is not an SQLite database.
    """
    if not url:
        return Database(file, in_place=in_place, schema=schema)
    if not url.startswith(("postgresql://", "postgres://")):
        raise ValueError("the database's URL begins with postgresql://")
    try:
        from roboglot.storage.postgresql import PostgreSQL
    except ModuleNotFoundError as missing:
        raise OSError(explained(missing, "a database's server") or str(missing)) from None
    return PostgreSQL(url, robots=robots, in_place=in_place, only_read=only_read)
