"""Interface between stores and databases: transactions, in SQL with ``?`` for parameters."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Protocol, Self, TypeVar

from roboglot.model.components.system.disk import Disk
from roboglot.model.errors import Refused, RobotError

T = TypeVar("T")


class DatabaseError(RobotError):
    """The database failed; the work was not done, or perhaps was, if the connection broke at its end."""


class AlreadyThere(DatabaseError):
    """A row with this key exists."""


class DiskFull(Refused):
    """No room is left on the robot's disk, or on the database's disk."""


FAILURES = DatabaseError, DiskFull  # of a transaction, apart from errors of its work


class Rows(Protocol):
    """Result of a statement."""

    @property
    def rowcount(self) -> int:
        """Number of changed rows."""

    def fetchone(self) -> Any:
        """Return the next row; None after the last."""

    def fetchall(self) -> list[Any]:
        """Return the remaining rows."""

    def __iter__(self) -> Iterator[Any]: ...


class Connection(Protocol):
    """Running transaction."""

    def execute(self, query: str, parameters: Sequence[object] = (), /) -> Rows:
        """Run a statement."""

    def executemany(self, query: str, parameters: Iterable[Sequence[object]], /) -> object:
        """Run a statement for each set of parameters."""


class Transactions(Protocol):
    """A database. Every call is one transaction; an error of ``work`` rolls it back. Raises DatabaseError, DiskFull.

    Calls of ``run`` and ``run_together`` by one caller are done in their order.
    """

    def on(self, disk: Disk | None) -> Self:
        """Return the same database for the robot with this disk: while the disk is full, only ``remove`` may write."""

    async def run(self, work: Callable[[Connection], T]) -> T:
        """Run ``work``; it is stored when this returns."""

    async def remove(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` that takes no room: it removes rows, or replaces one by a shorter one. A full disk allows it."""

    async def run_together(self, work: Callable[[Connection], T]) -> T:
        """Run frequent ``work`` of many callers; works that wait at the same time may share one flush."""

    async def read(self, work: Callable[[Connection], T]) -> T:
        """Run read-only ``work`` beside writing transactions; it sees all stored data."""

    def run_now(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` and block: for start-up, and where nothing else may run meanwhile."""

    def end_soon(self) -> None:
        """Prepare for ``close``, which must not wait long for a server that is silent."""

    def close(self) -> None:
        """Finish queued work, then close the database."""


async def outcome(writing: asyncio.Future[T], patience: float | None = None) -> T:
    """Return the outcome of ``writing``; a task cancelled meanwhile goes on to its next wait.

    ``patience``: real seconds that a cancelled task waits for the outcome at most.
    """
    cancelled, giving_up = False, None
    try:
        while True:
            try:
                return await asyncio.shield(writing)
            except asyncio.CancelledError:
                if writing.cancelled():
                    cancelled = False  # the task ends here
                    raise
                if patience is not None and giving_up is None:
                    giving_up = asyncio.get_running_loop().call_later(patience, writing.cancel)
                cancelled = True
    finally:
        if giving_up is not None:
            giving_up.cancel()
        if cancelled and (task := asyncio.current_task()) is not None:
            task.uncancel()  # it counts once, for timeouts
            task.cancel()
