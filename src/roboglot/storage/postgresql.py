"""A PostgreSQL database by URL, for what many robots share. Needs the extra ``roboglot[postgresql]`` (psycopg 3).

Every piece of work is a transaction in one of a few threads, each with a connection of its own; one that was lost while
nothing was under way is made anew. Knows no robot.
"""

from __future__ import annotations

import asyncio
import re
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import resources
from typing import Any, TypeVar

import psycopg

from roboglot.storage.transactions import Connection, Rows

T = TypeVar("T")

CONNECTIONS_MAX = 4
CONNECT_MAX, STATEMENT_MAX, IDLE_MAX = 5, 10, 10  # s for connecting, for a statement, for a transaction that waits
MIGRATION_LOCK = 0x726F626F  # who opens an empty database first makes the tables, the others wait


class PostgreSQL:
    """Open with ``PostgreSQL(url)``; close with ``close``. Raises OSError if the database can't be used."""

    def __init__(self, url: str) -> None:
        self._url = url
        self._own = threading.local()
        self._opened: list[psycopg.Connection[Any]] = []
        self._threads = ThreadPoolExecutor(max_workers=CONNECTIONS_MAX, thread_name_prefix="postgresql")
        try:
            self._threads.submit(self._transact, _migrate).result()
        except BaseException as error:
            self.close()
            if isinstance(error, psycopg.Error):
                raise OSError(str(error).strip().splitlines()[0]) from None
            raise

    async def run(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` as one transaction in a thread; an exception rolls it back.

        Raises psycopg.Error, also where the transaction may have been kept: when the connection broke at its end.
        """
        return await asyncio.get_running_loop().run_in_executor(self._threads, self._transact, work)

    def _transact(self, work: Callable[[Connection], T]) -> T:
        connection = self._begin()
        try:
            result = work(_Statements(connection))
            connection.execute("COMMIT")
        except BaseException:
            if not connection.closed:
                connection.rollback()
            raise
        return result

    def _begin(self) -> psycopg.Connection[Any]:
        """Return this thread's connection with a transaction begun; reconnects if it died while idle."""
        connection: psycopg.Connection[Any] | None = getattr(self._own, "connection", None)
        if connection is not None and not connection.closed:
            try:
                connection.execute("BEGIN")
            except psycopg.OperationalError:
                connection.close()
            else:
                return connection
        connection = self._own.connection = self._connect()
        connection.execute("BEGIN")
        return connection

    def _connect(self) -> psycopg.Connection[Any]:
        limits = f"-c statement_timeout={STATEMENT_MAX}s -c idle_in_transaction_session_timeout={IDLE_MAX}s"
        connection = psycopg.connect(
            self._url, autocommit=True, connect_timeout=CONNECT_MAX, options=limits, application_name="roboglot cloud"
        )
        self._opened = [opened for opened in self._opened if not opened.closed] + [connection]
        return connection

    def close(self) -> None:
        """Finish what is queued, then close the connections."""
        self._threads.shutdown()
        for connection in self._opened:
            connection.close()


class _Statements:
    """A connection that takes ``?`` for parameters, as SQLite does."""

    def __init__(self, connection: psycopg.Connection[Any]) -> None:
        self._connection = connection

    def execute(self, query: str, parameters: Sequence[Any] = (), /) -> Rows:
        return self._connection.execute(_marked(query), parameters)

    def executemany(self, query: str, parameters: Iterable[Sequence[Any]], /) -> None:
        with self._connection.cursor() as cursor:
            cursor.executemany(_marked(query), parameters)


def _marked(query: str) -> bytes:
    """None of our statements has a question mark or a percent sign of its own."""
    return query.replace("?", "%s").encode()


def _migrate(connection: Connection) -> None:
    """Apply the schema files that this database has not seen yet."""
    connection.execute("SELECT pg_advisory_xact_lock(?)", (MIGRATION_LOCK,))
    connection.execute("CREATE TABLE IF NOT EXISTS roboglot_schema (version INTEGER PRIMARY KEY)")
    current = connection.execute("SELECT COALESCE(MAX(version), 0) FROM roboglot_schema").fetchone()[0]
    files = resources.files("roboglot.storage.schema.postgresql")
    versions = sorted(int(m[1]) for f in files.iterdir() if (m := re.fullmatch(r"v(\d+)\.sql", f.name)))
    if current > versions[-1]:
        raise ValueError(
            f"the database is of version {current}, this program knows up to {versions[-1]}: use a newer one"
        )
    for version in versions:
        if version > current:
            connection.execute((files / f"v{version}.sql").read_text(encoding="utf-8"))
            connection.execute("INSERT INTO roboglot_schema (version) VALUES (?)", (version,))
