"""Interface between stores and any database: transactions, in SQL with ``?`` for parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Protocol, TypeVar

T = TypeVar("T")


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

    def execute(self, query: str, parameters: Sequence[Any] = (), /) -> Rows:
        """Run a statement."""

    def executemany(self, query: str, parameters: Iterable[Sequence[Any]], /) -> object:
        """Run a statement for each set of parameters."""


class Transactions(Protocol):
    """A database."""

    async def run(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` as one transaction: when this returns it is kept; an exception rolls it back."""

    def close(self) -> None:
        """Finish what is queued, then let go of the database."""
