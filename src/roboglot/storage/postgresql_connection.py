"""Connections to a PostgreSQL server that fail in time when it is gone, or accepts connections and never answers."""

from __future__ import annotations

import contextlib
import math
from typing import TypeVar

import psycopg
from psycopg.abc import PQGen, PQGenConn

from roboglot.hosting.steady_time import uptime

T = TypeVar("T")

CONNECT_MAX, STATEMENT_MAX, IDLE_MAX = 5, 10, 10  # s for connecting, for a statement, for an idle transaction
ANSWER_MAX = STATEMENT_MAX + 2.0  # s without an answer, after which the server itself would have ended the statement
CLOSE_MAX = 2.0  # s for all that a program asks for while it ends
LAST_MAX = 0.5  # s for each answer after that: a server that is merely slow gets all of it done
WAKE = 0.1  # s between two looks at the time
# Either side notices within five seconds that the other's machine is gone, even one to which it was sending: the server
# frees the robots by the time at which another node may have started their shard.
ON_SERVER = (
    f"-c statement_timeout={STATEMENT_MAX}s -c idle_in_transaction_session_timeout={IDLE_MAX}s"
    " -c tcp_keepalives_idle=2 -c tcp_keepalives_interval=1 -c tcp_keepalives_count=3 -c tcp_user_timeout=5s"
)

POOLED = (
    "a connection pooler answers there, under which neither the locks of robots nor our time limits hold: "
    "name the server itself"
)


class NoAnswer(psycopg.OperationalError):
    """The server is silent."""


class Patience:
    """Time for which a program waits for a server: less from ``end_soon`` on; one that was silent then is not asked."""

    answer_max = ANSWER_MAX  # s

    def __init__(self) -> None:
        self._end = math.inf  # uptime
        self.silent = ""  # why a program that ends does not ask again

    def end_soon(self) -> None:
        """Begin to end."""
        self._end = min(self._end, uptime() + CLOSE_MAX)

    def check(self, began: float, limit: float) -> None:
        """Raise NoAnswer if what ``began`` at that uptime has taken too long, ``limit`` s at most."""
        now = uptime()
        if now > self._end and now - began > LAST_MAX:
            self.silent = "no answer from the database's server, and the program ends"
            raise NoAnswer(self.silent)
        if now - began > limit:
            raise NoAnswer(f"no answer from the database's server for {limit:g} s")


class LimitedConnection(psycopg.Connection[tuple[object, ...]]):
    """A connection that breaks if the server gives no answer for longer than ``patience``, which its class has."""

    patience = Patience()

    def wait(self, gen: PQGen[T], interval: float = WAKE, timeout: float | None = None) -> T:
        """Wait for an answer. Raises NoAnswer."""
        assert timeout is None
        return super().wait(self._limited(gen), interval)

    def _limited(self, answer: PQGen[T]) -> PQGen[T]:
        """Pass on what ``answer`` waits for, until it has it or is late."""
        began = uptime()
        try:
            wanted = next(answer)
            while True:
                ready = yield wanted
                wanted = answer.send(ready)
                try:
                    self.patience.check(began, self.patience.answer_max)
                except NoAnswer:
                    self.close()
                    raise
        except StopIteration as done:
            result: T = done.value
            return result

    @classmethod
    def _connect_gen(cls, conninfo: str = "") -> PQGenConn[LimitedConnection]:
        """Connect as psycopg does, but give up when ``patience`` ends."""
        began, connecting = uptime(), super()._connect_gen(conninfo)
        try:
            wanted = next(connecting)
            while True:
                ready = yield wanted
                wanted = connecting.send(ready)
                cls.patience.check(began, math.inf)  # psycopg itself knows CONNECT_MAX
        except StopIteration as done:
            made: LimitedConnection = done.value
            return made


def limited_by(patience: Patience) -> type[LimitedConnection]:
    """Return the class of connections with this patience: psycopg makes them of classes."""
    return type("LimitedConnection", (LimitedConnection,), {"patience": patience})


def connect(url: str, kind: type[LimitedConnection]) -> LimitedConnection:
    """Return a new connection. Raises psycopg.Error, for a silent server and for a connection pooler, too."""
    try:
        connection = kind.connect(
            url,
            autocommit=True,
            connect_timeout=CONNECT_MAX,
            options=ON_SERVER,
            application_name="roboglot",
            keepalives_idle=2,
            keepalives_interval=1,
            keepalives_count=3,
            tcp_user_timeout=5000,
        )
    except psycopg.errors.ConnectionTimeout:
        raise NoAnswer(f"no answer from the database's server within {CONNECT_MAX} s") from None
    except psycopg.OperationalError as error:
        if "unsupported startup parameter" in str(error):
            raise psycopg.OperationalError(POOLED) from None
        raise
    if connection.execute("SHOW statement_timeout").fetchone() != (f"{STATEMENT_MAX}s",):
        connection.close()
        raise psycopg.OperationalError(POOLED)
    return connection


def close(connection: LimitedConnection) -> None:
    """Release the locks and close: the server would free the robots only on noticing the end."""
    if not connection.patience.silent:
        with contextlib.suppress(psycopg.Error):
            connection.execute("SELECT pg_advisory_unlock_all()")
    connection.close()
