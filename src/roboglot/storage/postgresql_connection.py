"""Connections to a PostgreSQL server that fail in time when it is gone, or accepts connections and never answers."""

from __future__ import annotations

import contextlib
from typing import TypeVar

import psycopg
from psycopg.abc import PQGen

from roboglot.hosting.steady_time import uptime

T = TypeVar("T")

CONNECT_MAX, STATEMENT_MAX, IDLE_MAX = 5, 10, 10  # s for connecting, for a statement, for an idle transaction
ANSWER_MAX = STATEMENT_MAX + 2.0  # s without an answer, after which the server itself would have ended the statement
CLOSE_MAX = 2.0  # s, for a program that ends
WAKE = 0.1  # s between two looks at the time
# Either side notices within five seconds that the other's machine is gone, even one to which it was sending: the server
# frees the robots by the time at which another node may have started their shard.
ON_SERVER = (
    f"-c statement_timeout={STATEMENT_MAX}s -c idle_in_transaction_session_timeout={IDLE_MAX}s"
    " -c tcp_keepalives_idle=2 -c tcp_keepalives_interval=1 -c tcp_keepalives_count=3 -c tcp_user_timeout=5s"
)


class NoAnswer(psycopg.OperationalError):
    """The server is silent."""


class LimitedConnection(psycopg.Connection[tuple[object, ...]]):
    """A connection that breaks if the server gives no answer for ``answer_max`` s."""

    answer_max = ANSWER_MAX

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
                if uptime() - began > self.answer_max:
                    self.close()
                    raise NoAnswer(f"no answer from the database's server for {self.answer_max:g} s")
        except StopIteration as done:
            result: T = done.value
            return result


def connect(url: str) -> LimitedConnection:
    """Return a new connection. Raises psycopg.Error, for a silent server, too."""
    try:
        return LimitedConnection.connect(
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


def close(connection: LimitedConnection) -> None:
    """Release the locks and close: the server would free the robots only on noticing the end."""
    connection.answer_max = CLOSE_MAX
    with contextlib.suppress(psycopg.Error):
        connection.execute("SELECT pg_advisory_unlock_all()")
    connection.close()
