"""The audit's table: rows are only appended, each with the hash of the previous one.

A separate SQLite file or, if robots are stored on a PostgreSQL server, a table there for all programs of a fleet.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple, Self

from roboglot.storage.opening import open_private
from roboglot.storage.transactions import Connection, Transactions

FILE = "audit.db"  # in the data folder
SCHEMA = "roboglot.storage.schema.audit"
PAGE = 1000  # rows per read
TEXT_MAX = 300  # characters per field
FIELDS = "number, at, who, address, robot, door, operation, outcome, reason, repeats, hash"


class Entry(NamedTuple):
    """One change or refusal. ``repeats``: number of equal ones before it without a row."""

    at: float  # Unix time, s
    who: str
    address: str
    robot: str
    door: str
    operation: str
    outcome: str  # "done", or the protocol's word for the refusal
    reason: str = ""
    repeats: int = 0


class BrokenChain(ValueError):
    """A row is missing or was changed."""


class End(NamedTuple):
    """The last row: its number and hash."""

    number: int
    hash: str


def open_trail(folder: Path, url: str = "") -> Trail:
    """Open the audit of a data folder, or of a PostgreSQL server. Raises OSError, ValueError, sqlite3.Error."""
    return Trail(open_private(folder / FILE, SCHEMA, url))


class Trail:
    """The table in a database. Methods block, from any thread. Raises DatabaseError."""

    def __init__(self, database: Transactions) -> None:
        self._database = database
        self._tried: tuple[Sequence[Entry], End] | None = None  # the last batch, which may or may not have been written

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the database."""
        self._database.close()

    def add(self, entries: Sequence[Entry]) -> None:
        """Add rows; they are stored when this returns. Retried with the same rows after an error, it adds them once."""
        self._database.run_now(lambda connection: self._add(connection, entries))
        self._tried = None

    def _add(self, connection: Connection, entries: Sequence[Entry]) -> None:
        connection.execute("UPDATE audit_turn SET taken=1")  # blocks other programs until this transaction ends
        if self._tried is not None and self._tried[0] == entries and _is_kept(connection, self._tried[1]):
            return  # the connection broke after the commit
        number, digest = _end(connection)
        for entry in map(_cut, entries):
            number += 1
            digest = _hash(digest, number, entry)
            connection.execute(f"INSERT INTO audit ({FIELDS}) VALUES ({_marks()})", (number, *entry, digest))
        self._tried = entries, End(number, digest)

    def rows(self, *, robot: str = "", after: int = 0) -> Iterator[tuple[int, Entry]]:
        """Yield rows with their numbers, of one robot or of all, from the one after number ``after``."""
        query = f"SELECT {FIELDS} FROM audit WHERE number > ? AND (? = '' OR robot = ?) ORDER BY number LIMIT {PAGE}"
        for number, entry, _ in self._pages(query, after, robot, robot):
            yield number, entry

    def verify(self) -> End:
        """Check all hashes and return the last row: stored elsewhere, it shows later that no row was cut off.

        Raises BrokenChain naming the first row that does not fit.
        """
        count, digest = 0, ""
        query = f"SELECT {FIELDS} FROM audit WHERE number > ? ORDER BY number LIMIT {PAGE}"
        for number, entry, kept in self._pages(query, 0):
            count += 1
            digest = _hash(digest, number, entry)
            if number != count or digest != kept:
                raise BrokenChain(f"row {count} does not fit the rows before it: the audit was changed there")
        return End(count, digest)

    def _pages(self, query: str, after: int, *values: str) -> Iterator[tuple[int, Entry, str]]:
        while page := self._database.run_now(partial(_page, query, values, after)):
            yield from page
            after = page[-1][0]


def _page(query: str, values: Sequence[str], after: int, connection: Connection) -> list[tuple[int, Entry, str]]:
    rows = connection.execute(query, (after, *values)).fetchall()
    return [(number, Entry(*fields), digest) for number, *fields, digest in rows]


def _end(connection: Connection) -> End:
    row = connection.execute("SELECT number, hash FROM audit ORDER BY number DESC LIMIT 1").fetchone()
    return End(*row) if row else End(0, "")


def _is_kept(connection: Connection, end: End) -> bool:
    query = "SELECT count(*) FROM audit WHERE number=? AND hash=?"
    return bool(connection.execute(query, end).fetchone()[0])


def _marks() -> str:
    return ", ".join("?" * (len(Entry._fields) + 2))


def _cut(entry: Entry) -> Entry:
    """Shorten every text to its limit, and replace characters that databases refuse."""
    return Entry._make(_plain(field) if isinstance(field, str) else field for field in entry)


def _plain(text: str) -> str:
    return text[:TEXT_MAX].encode("utf-8", "replace").decode()


def _hash(before: str, number: int, entry: Entry) -> str:
    return hashlib.sha256(json.dumps([before, number, *entry]).encode()).hexdigest()
