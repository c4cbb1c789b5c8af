"""The database that a configuration names: a file, or a PostgreSQL server by its URL."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from roboglot.storage.database import Database
from roboglot.storage.transactions import Transactions


def open_registry(where: str) -> Transactions:
    """Open the registry of robots' homes: a server's URL, or a file. Raises as ``open_database`` does."""
    return open_database(Path(), where) if "://" in where else open_database(Path(where))


def open_database(file: Path, url: str = "", robots: Collection[str] = (), *, in_place: bool = False) -> Transactions:
    """Open PostgreSQL by its ``url``, or without one the ``file``.

    ``robots``: this program alone writes what belongs to them, in the order of its calls. Raises ValueError for another
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
    return PostgreSQL(url, robots=robots, in_place=in_place)
