"""Calls of running programs and their answers, so that programs can go on after a crash."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from roboglot.storage.database import Database


@dataclass(frozen=True, slots=True)
class JournalEntry:
    """One call; ``answer`` is None while it is under way."""

    seq: int
    name: str
    answer: bytes | None


class JournalStore:
    """The journals of one robot's runs, by task. When a write returns, it survives a crash."""

    def __init__(self, database: Database, robot: str) -> None:
        self._database = database
        self._robot = robot

    async def begin(self, id: str, header: str) -> None:
        """An empty journal; one of the same name is forgotten."""

        def work(connection: sqlite3.Connection) -> None:
            self._remove(connection, [id])
            connection.execute("INSERT INTO program_run VALUES (?, ?, ?)", (self._robot, id, header))

        await self._database.run(work)

    async def write(self, id: str, entries: Sequence[JournalEntry]) -> None:
        """Add entries; a later one of the same number counts."""
        rows = [(self._robot, id, entry.seq, entry.name, entry.answer) for entry in entries]
        query = "INSERT OR REPLACE INTO program_call VALUES (?, ?, ?, ?, ?)"
        await self._database.run_together(lambda connection: connection.executemany(query, rows).close())

    async def remove(self, id: str) -> None:
        """Forget a journal."""
        await self._database.run(lambda connection: self._remove(connection, [id]))

    async def entries(self, id: str) -> list[JournalEntry]:
        """Return all calls in order."""
        query = "SELECT seq, name, answer FROM program_call WHERE robot=? AND id=? ORDER BY seq"
        return await self._database.run(
            lambda connection: [JournalEntry(*row) for row in connection.execute(query, (self._robot, id))]
        )

    def headers_now(self) -> dict[str, str]:
        """Return, at start-up, the journals and their headers."""
        query = "SELECT id, header FROM program_run WHERE robot=? ORDER BY id"
        return self._database.run_now(lambda connection: dict(connection.execute(query, (self._robot,)).fetchall()))

    def remove_now(self, ids: Collection[str]) -> None:
        """Drop these, at start-up."""
        self._database.run_now(lambda connection: self._remove(connection, ids))

    def _remove(self, connection: sqlite3.Connection, ids: Collection[str]) -> None:
        for table in ("program_run", "program_call"):
            connection.executemany(f"DELETE FROM {table} WHERE robot=? AND id=?", [(self._robot, id) for id in ids])
