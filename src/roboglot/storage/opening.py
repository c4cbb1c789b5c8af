"""The database that a configuration names: a file, or a PostgreSQL server by its URL."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from roboglot.storage.database import Database
from roboglot.storage.transactions import Transactions


def open_registry(where: str) -> Transactions:
    """Open the registry of robots' homes: a server's URL, or a file. Raises as ``open_database`` does."""
    return open_database(Path(), where) if "://" in where else open_database(Path(where))


def read_registry(where: str) -> Transactions:
    """Open it to look up homes only: on a server, a role suffices that may read the table ``robot_home``.

    Raises as ``open_database`` does, and OSError for a file that is not there.
    """
    if "://" in where:
        return open_database(Path(), where, only_read=True)
    if not Path(where).is_file():
        raise OSError(f"there is no file {where}")
    return open_database(Path(where))


def open_database(
    file: Path, url: str = "", robots: Collection[str] = (), *, in_place: bool = False, only_read: bool = False
) -> Transactions:
    """Open PostgreSQL by its ``url``, or without one the ``file``.

    ``robots``: this program alone writes what belongs to them, in the order of its calls. ``only_read``: a server's
    tables stay as they are, and nothing can be written. Raises ValueError for another
    kind of URL, or a database of a newer program; OSError if the server or its driver is missing or a robot is taken.
    """
    if not url:
        return Database(file, in_place=in_place)
    if not url.startswith(("postgresql://", "postgres://")):
        raise ValueError("the database's URL begins with postgresql://")
    try:
        from roboglot.storage.postgresql import PostgreSQL
    except ImportError:
        raise OSError("PostgreSQL needs another package, which roboglot's extra `postgresql` brings") from None
    return PostgreSQL(url, robots=robots, in_place=in_place, only_read=only_read)
