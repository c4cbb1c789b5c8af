"""Store of the reference cloud: accounts, their robots' programs, favourites, and records.

Tokens are stored as hashes. Knows no HTTP, no frame and no kind of database.
"""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Collection

from roboglot.storage.transactions import Connection, Transactions

PROGRAMS_MAX = 20_000  # per account
RECORDS_MAX = 10_000  # per account; the oldest are dropped first
NAME_MAX = 64  # characters of an account's name


class TooMany(Exception):
    """An account has reached its limit."""


class CloudStore:
    """Store of the cloud; every call is one transaction."""

    def __init__(self, database: Transactions) -> None:
        self._database = database

    async def add_account(self, name: str) -> str:
        """Open an account or replace its token; return the token, which cannot be read again. Raises ValueError."""
        if not name.strip() or len(name) > NAME_MAX or not name.isprintable():
            raise ValueError(f"an account's name has 1 to {NAME_MAX} characters")
        token = secrets.token_urlsafe(32)
        query = (
            "INSERT INTO cloud_account (name, token_hash) VALUES (?, ?)"
            " ON CONFLICT (name) DO UPDATE SET token_hash=excluded.token_hash"
        )
        await self._database.run(lambda connection: connection.execute(query, (name, _hash(token))))
        return token

    async def account_of(self, token: str) -> str | None:
        """Return the account of a token, or None."""
        query = "SELECT name FROM cloud_account WHERE token_hash=?"
        row = await self._database.run(lambda connection: connection.execute(query, (_hash(token),)).fetchone())
        return row[0] if row else None

    async def save(self, account: str, kind: str, id: str, document: str) -> None:
        """Store a program of a robot; a favourite stays one. Raises TooMany."""

        def work(connection: Connection) -> None:
            connection.execute(
                "INSERT INTO cloud_program (account, kind, id, document) VALUES (?, ?, ?, ?)"
                " ON CONFLICT (account, kind, id) DO UPDATE SET document=excluded.document",
                (account, kind, id, document),
            )
            count = connection.execute("SELECT COUNT(*) FROM cloud_program WHERE account=?", (account,)).fetchone()[0]
            if count > PROGRAMS_MAX:
                raise TooMany(f"an account has at most {PROGRAMS_MAX} programs")

        await self._database.run(work)

    async def delete(self, account: str, kind: str, ids: Collection[str]) -> None:
        """Delete programs, but not favourites."""
        rows = [(account, kind, id) for id in ids]
        query = "DELETE FROM cloud_program WHERE account=? AND kind=? AND id=? AND favourite=0"
        await self._database.run(lambda connection: connection.executemany(query, rows))

    async def set_favourite(self, account: str, kind: str, id: str, *, favourite: bool) -> bool:
        """Mark a program; return False if it does not exist."""
        query = "UPDATE cloud_program SET favourite=? WHERE account=? AND kind=? AND id=?"
        row = (int(favourite), account, kind, id)
        return await self._database.run(lambda connection: connection.execute(query, row).rowcount == 1)

    async def favourites(self, account: str, kind: str, without: Collection[str]) -> list[str]:
        """Return the favourites' documents by id, except those in ``without``."""
        known = frozenset(without)
        query = "SELECT id, document FROM cloud_program WHERE account=? AND kind=? AND favourite=1 ORDER BY id"
        return await self._database.run(
            lambda connection: [doc for id, doc in connection.execute(query, (account, kind)) if id not in known]
        )

    async def record(self, account: str, robot: str, document: str) -> None:
        """Store an event of a robot."""

        def work(connection: Connection) -> None:
            row = (account, robot, document)
            connection.execute("INSERT INTO cloud_record (account, robot, document) VALUES (?, ?, ?)", row)
            connection.execute(
                "DELETE FROM cloud_record WHERE account=? AND seq <= (SELECT seq FROM cloud_record WHERE account=?"
                " ORDER BY seq DESC LIMIT 1 OFFSET ?)",
                (account, account, RECORDS_MAX),
            )

        await self._database.run(work)

    async def records(self, account: str, most: int) -> list[tuple[str, str]]:
        """Return robot and document of the newest ``most`` records, oldest first."""
        query = "SELECT robot, document FROM cloud_record WHERE account=? ORDER BY seq DESC LIMIT ?"
        return await self._database.run(lambda connection: connection.execute(query, (account, most)).fetchall()[::-1])


def _hash(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "replace")).hexdigest()
