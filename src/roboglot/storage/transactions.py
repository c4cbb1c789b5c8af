"""Interface between stores and any database: transactions, in SQL with ``?`` for parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Protocol, Self, TypeVar

from roboglot.model.components.system.disk import Disk
from roboglot.model.errors import Refused, RobotError

T = TypeVar("T")


class DatabaseError(RobotError):
    """The database failed; the work was not done, or (its connection broke at the end) perhaps."""


class AlreadyThere(DatabaseError):
    """A row of this key exists."""


class DiskFull(Refused):
    """No room is left on the robot's disk, or on the one where its database is."""


class Rows(Protocol):
    """Result of a statement."""

    @property
    def rowcount(self) -> int:
        """Number of changed rows."""

    def fetchone(self) -> Any:
        """The next row; None: there is none left."""

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
    """A database. Every call is one transaction, which what ``work`` raises rolls back. Raises DatabaseError, DiskFull.

    What one caller writes with ``run`` and ``run_together`` is done in the order of the calls.
    """

    def on(self, disk: Disk) -> Self:
        """Return the same for the robot that has this disk: while nothing is left on it, writing raises DiskFull."""

    async def run(self, work: Callable[[Connection], T]) -> T:
        """Run ``work``: when this returns it is kept."""

    async def run_together(self, work: Callable[[Connection], T]) -> T:
        """Run what many do often; works that wait at the same time may be kept by one flush."""

    async def read(self, work: Callable[[Connection], T]) -> T:
        """Run ``work``, which changes nothing, beside what is being written; it sees all that is kept."""

    def run_now(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` and wait in place: for start-up, and where nothing else may go on."""

    def close(self) -> None:
        """Finish what is queued, then let go of the database."""
