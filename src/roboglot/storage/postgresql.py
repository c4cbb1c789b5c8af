"""A PostgreSQL database by URL, shared by many robots. Needs the extra ``roboglot[postgresql]`` (psycopg 3).

Every piece of work is a transaction in one of a few threads, each with its own connection, which is renewed if it was
lost while idle. Work that waited while a connection could not be renewed fails with it. Knows no robot.
"""

from __future__ import annotations

import asyncio
import copy
import functools
import logging
import re
import threading
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from ipaddress import ip_address
from pathlib import Path
from typing import Any, TypeVar

import psycopg

from roboglot.hosting.steady_time import uptime
from roboglot.model.components.system.disk import Disk
from roboglot.storage.database import schema_versions
from roboglot.storage.postgresql_connection import LimitedConnection, Patience, close, connect, limited_by
from roboglot.storage.transactions import AlreadyThere, Connection, DatabaseError, DiskFull, Rows, outcome
from roboglot.text_files import content_of
from roboglot.transport.log_limiter import LogLimiter

T = TypeVar("T")
log = logging.getLogger(__name__)
limited_log = LogLimiter(log)

CONNECTIONS_MAX = 4
OUTCOME_MAX = 1.0  # s that a cancelled caller waits for the server
CLAIM_MAX = 6000  # ms; the server notices within five seconds that a machine is gone
CLAIM_LOCKS = 0x626F74  # the class of the locks by which a program claims its robots
PIECE_MIN = 3  # characters of a password that an error may not show
ESCAPE = "\ue000"  # of Unicode's private use
CHECKING = "verify-ca", "verify-full"  # values of libpq's sslmode that check the server's certificate
EXPOSED = (
    "the database's certificate is not checked: others on the network may read and change the robots' data; "
    "add sslmode=verify-full to its URL"
)
MIGRATION_LOCK = 0x726F626F  # the program that opens an empty database first creates the tables; others wait


class PostgreSQL:
    """Open with ``PostgreSQL(url)``; close with ``close``. Raises OSError if the database can't be used.

    ``robots``: only this program may write their data. All writes are then in the order of the calls, over one
    connection that holds a server lock for each robot: no other program gets the lock while the connection lasts, and a
    program that has lost it writes nothing. ``in_place``: ``run`` blocks, for a lockstep clock. ``only_read``: no
    migration of tables; writing fails.
    """

    def __init__(
        self, url: str, *, robots: Collection[str] = (), in_place: bool = False, only_read: bool = False
    ) -> None:
        self._url, self._robots, self._in_place, self._only_read = url, tuple(robots), in_place, only_read
        connections = 1 if robots else CONNECTIONS_MAX
        self._disk: Disk | None = None
        self._own = threading.local()
        self._opened: list[LimitedConnection] = []
        self._opening = threading.Lock()
        self._patience = Patience()
        self._kind = limited_by(self._patience)
        self._lock_timeout = CLAIM_MAX
        self._threads = ThreadPoolExecutor(
            max_workers=connections,
            thread_name_prefix="database",
            initializer=lambda: setattr(self._own, "writes", True),
        )
        self._readers = ThreadPoolExecutor(max_workers=1, thread_name_prefix="database reader")
        try:
            prepare = _is_there if only_read else _migrate
            self._threads.submit(self._committed, prepare, read_only=only_read, asked=uptime()).result()
        except BaseException as error:
            self.close()
            if isinstance(error, psycopg.Error | DatabaseError):
                raise OSError(in_one_line(error)) from None
            raise
        if is_exposed(self._opened[0].pgconn.hostaddr.decode(), _option(self._opened[0], b"sslmode")):
            log.warning(EXPOSED)
        self._lock_timeout = 0  # who loses a robot later must not wait for it

    def on(self, disk: Disk | None) -> PostgreSQL:
        """Return the same database for the robot with this disk: while the disk is full, only ``remove`` may write."""
        database = copy.copy(self)
        database._disk = disk
        return database

    async def run(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` as one transaction in a thread; an exception rolls it back.

        A caller that is cancelled meanwhile still gets the outcome, unless the server hangs. Raises DatabaseError, even
        if the transaction may have been committed, as the connection broke at its end.
        """
        if self._in_place:
            return self.run_now(work)
        writing = functools.partial(self._transact, work, asked=uptime())
        return await outcome(asyncio.get_running_loop().run_in_executor(self._threads, writing), OUTCOME_MAX)

    run_together = run  # the server itself combines disk flushes of transactions that end together

    async def remove(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` that takes no room, as ``run`` does, also while the robot's disk is full."""
        return await self.on(None).run(work)

    async def read(self, work: Callable[[Connection], T]) -> T:
        """Run read-only ``work`` beside writing transactions."""
        if self._in_place:
            return self.run_now(work)
        reading = functools.partial(self._transact, work, read_only=True, asked=uptime())
        return await asyncio.get_running_loop().run_in_executor(self._readers, reading)

    def run_now(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` and block: for start-up, and where nothing else may run meanwhile."""
        return self._threads.submit(self._transact, work, asked=uptime()).result()

    def _transact(self, work: Callable[[Connection], T], *, read_only: bool = False, asked: float) -> T:
        """Run ``work``; ``asked``: uptime at which a client did."""
        full = self._disk is not None and self._disk.free <= 0
        try:
            return self._committed(work, read_only=read_only or full, asked=asked)
        except psycopg.errors.ReadOnlySqlTransaction as error:
            if full:
                raise DiskFull("the disk is full") from None
            raise _failed(error) from error
        except psycopg.IntegrityError as error:
            raise AlreadyThere("the database has such a row") from error
        except psycopg.errors.DiskFull as error:
            raise DiskFull("the database's disk is full") from error
        except psycopg.Error as error:
            raise _failed(error) from error

    def _committed(self, work: Callable[[Connection], T], *, read_only: bool, asked: float) -> T:
        connection = self._begin(b"BEGIN READ ONLY" if read_only or self._only_read else b"BEGIN", asked)
        try:
            result = work(_Statements(connection))
            connection.execute("COMMIT")
        except BaseException:
            if not connection.closed:
                connection.rollback()
            raise
        return result

    def _begin(self, begin: bytes, asked: float) -> LimitedConnection:
        """Return this thread's connection with a transaction begun; reconnects if it died while idle."""
        if self._patience.silent:
            raise psycopg.OperationalError(self._patience.silent)
        connection: LimitedConnection | None = getattr(self._own, "connection", None)
        if connection is not None and not connection.closed:
            try:
                connection.execute(begin)
            except psycopg.OperationalError:
                connection.close()
                if self._patience.silent:
                    raise
            else:
                return connection
        connection = self._own.connection = self._connect(asked)
        if getattr(self._own, "writes", False):
            self._claim(connection)
        connection.execute(begin)
        return connection

    def _claim(self, connection: LimitedConnection) -> None:
        """Take the robots' locks, which end with the connection. Raises DatabaseError if another program has one.

        The first connection waits for those of a program whose machine is gone: a cluster would start the shard again,
        which takes longer.
        """
        for robot in self._robots:
            query, lock = "SELECT pg_try_advisory_lock(%s, hashtext(%s))", (CLAIM_LOCKS, robot)
            (free,) = connection.execute(query, lock).fetchone() or (False,)
            if not free and self._lock_timeout:
                free = self._waited(connection, lock)
            if not free:
                connection.close()
                raise DatabaseError(f"robot {robot} is served by another program from the same database")

    def _waited(self, connection: LimitedConnection, lock: tuple[int, str]) -> bool:
        """Wait for a robot's lock; return whether it was released in time."""
        log.info("another program serves robot %s: waiting %d ms for its end", lock[1], self._lock_timeout)
        connection.execute(f"SET lock_timeout = {self._lock_timeout}".encode())
        try:
            connection.execute("SELECT pg_advisory_lock(%s, hashtext(%s))", lock)
        except psycopg.errors.LockNotAvailable:
            return False
        connection.execute("SET lock_timeout = 0")
        return True

    def _connect(self, asked: float) -> LimitedConnection:
        """Return a new connection. Raises psycopg.Error, at once if a try failed since the work was ``asked`` for."""
        failed_at, why = getattr(self._own, "failed", (asked, ""))
        if failed_at > asked:
            raise psycopg.OperationalError(why)
        try:
            connection = connect(self._url, self._kind)
        except psycopg.Error as error:
            error.args = (without_password(str(error), self._url),)
            self._own.failed = uptime(), str(error)
            raise
        with self._opening:
            self._opened[:] = [*(opened for opened in self._opened if not opened.closed), connection]
        return connection

    def end_soon(self) -> None:
        """Wait for a silent server no longer than a program that ends may."""
        self._patience.end_soon()

    def close(self) -> None:
        """Finish queued work, then close the connections."""
        self.end_soon()
        self._threads.shutdown()
        self._readers.shutdown()
        for connection in self._opened:
            close(connection)


class _Rows:
    """A result with texts unescaped."""

    def __init__(self, cursor: psycopg.Cursor[Any]) -> None:
        self._cursor = cursor

    @property
    def rowcount(self) -> int:
        return self._cursor.rowcount

    def fetchone(self) -> object:
        row = self._cursor.fetchone()
        return None if row is None else _restored(row)

    def fetchall(self) -> list[object]:
        return [_restored(row) for row in self._cursor.fetchall()]

    def __iter__(self) -> Iterator[object]:
        return map(_restored, self._cursor)


class _Statements:
    """A connection that, like SQLite, takes ``?`` for parameters and every character in a text."""

    def __init__(self, connection: LimitedConnection) -> None:
        self._connection = connection

    def execute(self, query: str, parameters: Sequence[object] = (), /) -> Rows:
        return _Rows(self._connection.execute(_marked(query), _storable(parameters)))

    def executemany(self, query: str, parameters: Iterable[Sequence[object]], /) -> None:
        with self._connection.cursor() as cursor:
            cursor.executemany(_marked(query), map(_storable, parameters))


def _marked(query: str) -> bytes:
    """Return a statement with ``%s`` for each ``?``; no statement of ours has other ``?`` or ``%``."""
    return query.replace("?", "%s").encode()


def _storable(values: Sequence[object]) -> Sequence[object]:
    """Return values with the character 0, which PostgreSQL texts cannot hold, as ``ESCAPE`` and a digit."""
    return [
        value.replace(ESCAPE, f"{ESCAPE}1").replace("\0", f"{ESCAPE}0")
        if isinstance(value, str) and ("\0" in value or ESCAPE in value)
        else value
        for value in values
    ]


def _restored(row: Sequence[object]) -> tuple[object, ...]:
    return tuple(
        value.replace(f"{ESCAPE}0", "\0").replace(f"{ESCAPE}1", ESCAPE)
        if isinstance(value, str) and ESCAPE in value
        else value
        for value in row
    )


def without_password(text: str, url: str) -> str:
    """Return a database's error without parts of the password in ``url``, which errors of a malformed URL quote."""
    shown = url.partition("://")[2].rpartition("@")[0].partition(":")[2]
    secrets = [shown, *re.findall(r"password=([^&\s]+)", url)]
    pieces = {
        piece for secret in secrets for piece in (secret, *re.split(r"[^\w-]", secret)) if len(piece) >= PIECE_MIN
    }
    for piece in (url, *sorted(pieces, key=len, reverse=True)):
        text = text.replace(piece, "…")
    return text


def is_exposed(address: str, ssl_mode: str) -> bool:
    """Return whether others on the way to a server may read and change what passes.

    ``address``: the server's IP address; empty for a Unix socket. ``ssl_mode``: libpq's ``sslmode``.
    """
    return bool(address) and not ip_address(address).is_loopback and ssl_mode not in CHECKING


def _option(connection: LimitedConnection, name: bytes) -> str:
    """Return an option of an open connection, from its URL, a service file or the environment."""
    return next((o.val or b"" for o in connection.pgconn.info if o.keyword == name), b"").decode()


def in_one_line(error: Exception) -> str:
    """Return libpq's text without line breaks, for the log: it names hosts and people."""
    return " ".join(str(error).split())


def _failed(error: psycopg.Error) -> DatabaseError:
    """Log the error; return one that clients may see."""
    limited_log.warning("database", "the database failed: %s", in_one_line(error))
    away = isinstance(error, psycopg.OperationalError)
    return DatabaseError("the database cannot be reached" if away else "the database failed")


def _is_there(connection: Connection) -> None:
    """Raise DatabaseError if this is not a database of ours, or one of an earlier version."""
    connection.execute("SELECT gateway FROM robot_home WHERE robot=''")


def _migrate(connection: Connection) -> None:
    """Apply the schema files that this database has not seen yet."""
    connection.execute("SELECT pg_advisory_xact_lock(?)", (MIGRATION_LOCK,))
    connection.execute("CREATE TABLE IF NOT EXISTS roboglot_schema (version INTEGER PRIMARY KEY)")
    current = connection.execute("SELECT COALESCE(MAX(version), 0) FROM roboglot_schema").fetchone()[0]
    files = Path(*import_module("roboglot.storage.schema.postgresql").__path__)
    versions = schema_versions(files)
    if current > versions[-1]:
        raise ValueError(
            f"the database is of version {current}, this program knows up to {versions[-1]}: use a newer one"
        )
    for version in versions:
        if version > current:
            connection.execute(content_of(files / f"v{version}.sql").decode())
            connection.execute("INSERT INTO roboglot_schema (version) VALUES (?)", (version,))
