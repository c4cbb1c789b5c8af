"""What a store asks of a database, whichever it is: transactions, in SQL with ``?`` for parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Protocol, TypeVar

T = TypeVar("T")


class Rows(Protocol):
    """What a statement found or did."""

    @property
    def rowcount(self) -> int:
        """How many rows it changed."""

    def fetchone(self) -> Any:
        """The next row; None: there is none left."""

    def fetchall(self) -> list[Any]:
        """All that are left."""

    def __iter__(self) -> Iterator[Any]: ...


class Connection(Protocol):
    """One transaction under way."""

    def execute(self, query: str, parameters: Sequence[Any] = (), /) -> Rows:
        """One statement."""

    def executemany(self, query: str, parameters: Iterable[Sequence[Any]], /) -> object:
        """One statement, again for each."""


class Transactions(Protocol):
    """A database."""

    async def run(self, work: Callable[[Connection], T]) -> T:
        """Run ``work`` as one transaction: when this returns it is kept; an exception rolls it back."""

    def close(self) -> None:
        """Finish what is queued, then let go of the database."""
