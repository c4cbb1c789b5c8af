"""One SQLite file, with a thread that writes and one that reads; each piece of work is a transaction. Knows no robot.

WAL with ``synchronous=FULL``: when ``run`` returns, the work survives ``kill -9`` and a power cut.
"""

from __future__ import annotations

import asyncio
import contextlib
import copy
import re
import sqlite3
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

from roboglot.model.components.system.disk import Disk
from roboglot.storage.transactions import AlreadyThere, Connection, DatabaseError, DiskFull, outcome
from roboglot.text_files import content_of

T = TypeVar("T")
Work = Callable[[Connection], object]
ROBOTS = "roboglot.storage.schema"  # tables of the robots' memory
TRANSACTION = ("BEGIN TRANSACTION;", "COMMIT;")  # around a dump
WAIT = 5.0  # s for other programs that use the file


class Database:
    """Open with ``Database(path)``; close with ``close``. ``path`` may be ":memory:": nothing is kept.

    ``in_place``: ``run`` blocks, for a lockstep clock, which would otherwise advance meanwhile by a different amount
    each time, so that the robot's behaviour would depend on the disk's speed. A database in memory always blocks.
    ``schema``: the package with its tables.
    """

    def __init__(self, path: Path | str, *, in_place: bool = False, schema: str = ROBOTS) -> None:
        self._in_place = in_place or str(path) == ":memory:"
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="database")
        self._connection = self._thread.submit(connect, str(path), schema).result()
        self._reader = None if self._in_place else _Reader(path)
        self._disk: Disk | None = None
        self._together: list[_Waiting] = []  # shared by the copies for single robots

    def on(self, disk: Disk | None) -> Database:
        """Return the same file for the robot with this disk: while the disk is full, only ``remove`` may write."""
        database = copy.copy(self)
        database._disk = disk
        return database

    async def run(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` in the database's thread as one transaction; an exception rolls it back.

        A caller that is cancelled meanwhile still gets the outcome, so that its copy in memory is that on disk.
        """
        if self._in_place:
            return self.run_now(work)
        return await outcome(asyncio.get_running_loop().run_in_executor(self._thread, self._transact, work))

    async def remove(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` that takes no room, as ``run`` does, also while the robot's disk is full."""
        return await self.on(None).run(work)

    async def read(self, work: Callable[[Connection], T]) -> T:
        """Run read-only ``work`` beside writing transactions, without waiting for a flush of the disk.

        It sees everything whose ``run`` has returned.
        """
        if self._reader is None:
            return self.run_now(work)
        return await asyncio.get_running_loop().run_in_executor(self._reader.thread, self._reader.read, work)

    async def run_together(self, work: Callable[[Connection], T]) -> T:
        """Run frequent ``work`` of many callers in one transaction for all that wait, with one flush of the disk.

        At most one such transaction is queued at a time, so every other ``run`` waits for at most that one. If the work
        of one caller fails, that of the others is still done.
        """
        if self._in_place:
            return self.run_now(work)
        mine: asyncio.Future[T] = asyncio.get_running_loop().create_future()
        self._together.append((self, work, mine))
        if len(self._together) == 1:
            asyncio.get_running_loop().call_soon(self._flush)  # with what others ask for meanwhile
        return await mine

    def _flush(self) -> None:
        """Begin a transaction for all that wait. No task: at its end a loop cancels those, while callers may wait."""
        batch = tuple(self._together)
        works = [(database, work) for database, work, _ in batch]
        try:
            doing = asyncio.get_running_loop().run_in_executor(self._thread, self._transact_all, works)
        except RuntimeError as closed:
            self._settle(batch, [(None, closed)] * len(batch))
        else:
            doing.add_done_callback(lambda done: self._settle(batch, _results(done, len(batch))))

    def _settle(self, batch: tuple[_Waiting, ...], results: list[_Result]) -> None:
        """Give each caller of a batch its outcome; then begin with those that came meanwhile."""
        del self._together[: len(batch)]
        for (_, _, waiting), (result, error) in zip(batch, results, strict=True):
            if not waiting.done():
                waiting.set_result(result) if error is None else waiting.set_exception(error)
        if self._together:
            self._flush()

    def _transact_all(self, works: list[tuple[Database, Work]]) -> list[_Result]:
        results: list[_Result] = []

        def all_of_them(connection: Connection) -> None:
            for database, work in works:
                connection.execute("SAVEPOINT one")
                try:
                    with database_errors():
                        results.append((_without_cursor(database._within_room(work)), None))
                except Exception as error:
                    connection.execute("ROLLBACK TO one")
                    results.append((None, error))
                connection.execute("RELEASE one")

        self._in_transaction(all_of_them)
        return results

    def run_now(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` and block: for start-up, and where nothing else may run meanwhile."""
        return self._thread.submit(self._transact, work).result()

    def _transact(self, work: Callable[[Connection], T]) -> T:
        return self._in_transaction(lambda _: self._within_room(work))

    def _in_transaction(self, work: Callable[[Connection], T]) -> T:
        with database_errors():
            return self._committed(work)

    def _committed(self, work: Callable[[Connection], T]) -> T:
        self._connection.execute("BEGIN IMMEDIATE")
        try:
            result = work(self._connection)
            self._connection.execute("COMMIT")
        except BaseException:
            if self._connection.in_transaction:  # a full disk ends some transactions on its own
                self._connection.execute("ROLLBACK")
            raise
        return _without_cursor(result)

    def _within_room(self, work: Callable[[Connection], T]) -> T:
        if self._disk is None or self._disk.free > 0:
            return work(self._connection)
        self._connection.execute("PRAGMA query_only=ON")
        try:
            return work(self._connection)
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode == sqlite3.SQLITE_READONLY:
                raise DiskFull("the disk is full") from None
            raise
        finally:
            self._connection.execute("PRAGMA query_only=OFF")

    def end_soon(self) -> None:
        """Do nothing: a file answers."""

    def close(self) -> None:
        """Finish queued work, then close the file."""
        if self._reader is not None:
            self._reader.close()
        self._thread.submit(self._connection.close).result()
        self._thread.shutdown()


_Waiting = tuple[Database, Work, asyncio.Future[Any]]
_Result = tuple[object, BaseException | None]


def _results(done: asyncio.Future[list[_Result]], count: int) -> list[_Result]:
    broken = done.exception()
    return done.result() if broken is None else [(None, broken)] * count


def _without_cursor(result: T) -> T:
    """Close a cursor: left to another thread's garbage collector, it would reset a statement in use here."""
    if isinstance(result, sqlite3.Cursor):
        result.close()
    return result


class _Reader:
    """The reading thread, with its own connection from the first read on."""

    def __init__(self, path: Path | str) -> None:
        self.thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="database reader")
        self._path = path
        self._connection: sqlite3.Connection | None = None

    def read(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` in one transaction; call it in the thread."""
        with database_errors():
            if self._connection is None:
                self._connection = sqlite3.connect(self._path, isolation_level=None, timeout=WAIT)
                self._connection.execute("PRAGMA query_only=ON")
            self._connection.execute("BEGIN")
            try:
                return work(self._connection)
            finally:
                self._connection.execute("ROLLBACK")

    def close(self) -> None:
        """Finish queued work, then close the file."""
        self.thread.submit(self._close).result()  # behind a first read, which opens it
        self.thread.shutdown()

    def _close(self) -> None:
        if self._connection is not None:
            self._connection.close()


@contextlib.contextmanager
def database_errors() -> Iterator[None]:
    """Raise SQLite's errors as the stores' errors."""
    try:
        yield
    except sqlite3.IntegrityError as error:
        raise AlreadyThere(str(error)) from error
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode == sqlite3.SQLITE_FULL:
            raise DiskFull("the disk is full") from error
        raise DatabaseError(str(error)) from error
    except sqlite3.Error as error:
        raise DatabaseError(str(error)) from error


def connect(path: Path | str, schema: str = ROBOTS) -> sqlite3.Connection:
    """Open the file with the newest schema, outside of any transaction. Raises ValueError for a newer one."""
    connection = sqlite3.connect(path, isolation_level=None, timeout=WAIT)
    try:
        _log_ahead(connection)
        connection.execute("PRAGMA synchronous=FULL")
        connection.execute("PRAGMA foreign_keys=ON")
        if str(path) == ":memory:" and hasattr(connection, "deserialize"):
            connection.deserialize(_empty(schema))
        else:
            _migrate(connection, schema)
    except BaseException:
        connection.close()
        raise
    return connection


def _log_ahead(connection: sqlite3.Connection) -> None:
    """Set the journal's mode; SQLite itself does not wait while another program does so in a new file."""
    until = time.monotonic() + WAIT  # noqa: TID251 - files know no robot's time
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL")
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > until:  # noqa: TID251
                raise
            time.sleep(0.01)  # noqa: TID251
        else:
            return


@cache
def _empty(schema: str) -> bytes:
    """Return an empty database with the newest schema."""
    with contextlib.closing(sqlite3.connect(":memory:", isolation_level=None)) as connection:
        _migrate(connection, schema, in_steps=True)
        return connection.serialize()


@cache
def newest_tables(schema: str = ROBOTS) -> tuple[str, ...]:
    """Return the statements that make a new database of the newest schema."""
    with contextlib.closing(sqlite3.connect(":memory:", isolation_level=None)) as connection:
        _migrate(connection, schema, in_steps=True)
        version = f"PRAGMA user_version={_version(connection)}"
        return (*(line for line in connection.iterdump() if line not in TRANSACTION), version)


def schema_versions(files: Path) -> list[int]:
    """Return the versions that a folder of schema files leads to."""
    return sorted(int(m[1]) for f in files.iterdir() if (m := re.fullmatch(r"v(\d+)\.sql(\.gz)?", f.name)))


def _migrate(connection: sqlite3.Connection, schema: str, *, in_steps: bool = False) -> None:
    """Apply the schema files that this database has not seen yet; other programs may do so at the same time.

    A new database gets the result of all at once, with one flush of the disk; ``in_steps``: it does not.
    """
    files = Path(*import_module(schema).__path__)
    versions = schema_versions(files)
    while (current := _version(connection)) != versions[-1]:
        if current > versions[-1]:
            raise ValueError(
                f"the database is of version {current}, this program knows up to {versions[-1]}: use a newer one"
            )
        connection.execute("BEGIN IMMEDIATE")  # an error closes the connection, which undoes it
        if _version(connection) == current:  # else another program was faster
            new = not in_steps and not connection.execute("SELECT * FROM sqlite_master").fetchone()
            version = next(version for version in versions if version > current)
            for statement in newest_tables(schema) if new else _statements(files / f"v{version}.sql", version):
                connection.execute(statement)
        connection.execute("COMMIT")


def _version(connection: sqlite3.Connection) -> int:
    return int(connection.execute("PRAGMA user_version").fetchone()[0])


def _statements(script: Path, version: int) -> Iterator[str]:
    """Yield each statement that leads to ``version``; ``executescript`` would end the transaction."""
    statement = ""
    for line in content_of(script).decode().splitlines(keepends=True):
        statement += line
        if sqlite3.complete_statement(statement):
            yield statement
            statement = ""
    yield f"PRAGMA user_version={version}"
