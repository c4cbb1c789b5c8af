"""Transfer of one robot's data from one database to another, when the robot moves to another process."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

from roboglot.storage.database import connect

OF_OTHERS = frozenset({"cloud_record"})  # tables that mention a robot but belong to others


def copy_robot(robot: str, source: Path, target: Path) -> int:
    """Copy all rows of ``robot``, replacing its rows in ``target``; return their number.

    The rows are stored when this returns. The two files may not be in use. A missing source counts as empty.
    """
    if not source.exists():
        return 0
    connect(source).close()  # both with the newest schema, so that their columns match
    with closing(connect(target)) as connection:
        connection.execute("ATTACH ? AS source", (str(source),))
        connection.execute("BEGIN IMMEDIATE")
        copied = sum(_copy(connection, table, robot) for table in _tables(connection))
        connection.execute("COMMIT")
    return copied


def forget_robot(robot: str, database: Path) -> None:
    """Delete all rows of ``robot``. The file may not be in use."""
    if not database.exists():
        return
    with closing(connect(database)) as connection:
        connection.execute("BEGIN IMMEDIATE")
        for table in _tables(connection):
            connection.execute(f'DELETE FROM "{table}" WHERE robot = ?', (robot,))
        connection.execute("COMMIT")


def _tables(connection: sqlite3.Connection) -> list[str]:
    names = connection.execute("SELECT name FROM main.sqlite_master WHERE type = 'table' ORDER BY name").fetchall()
    return [
        name
        for (name,) in names
        if name not in OF_OTHERS and any(column[1] == "robot" for column in _columns(connection, name))
    ]


def _columns(connection: sqlite3.Connection, table: str) -> list[tuple[int, str, str, int, object, int]]:
    return connection.execute(f'PRAGMA main.table_info("{table}")').fetchall()


def _copy(connection: sqlite3.Connection, table: str, robot: str) -> int:
    """Copy rows without their numbers, which only give their order."""
    columns = _columns(connection, table)
    keys = [column for column in columns if column[5]]
    numbered = keys[0][1] if len(keys) == 1 and keys[0][2] == "INTEGER" else None
    order = f'ORDER BY "{numbered}"' if numbered else ""
    names = ", ".join(f'"{column[1]}"' for column in columns if column[1] != numbered)
    connection.execute(f'DELETE FROM main."{table}" WHERE robot = ?', (robot,))
    copied = connection.execute(
        f'INSERT INTO main."{table}" ({names}) SELECT {names} FROM source."{table}" WHERE robot = ? {order}',
        (robot,),
    )
    return copied.rowcount
