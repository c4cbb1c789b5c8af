"""Journals of running programs in a database: calls and answers, so that a run can continue after a crash."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import TypeVar

from roboglot.programs.stores import JournalEntry
from roboglot.storage.program_errors import store_errors
from roboglot.storage.transactions import Connection, Transactions

T = TypeVar("T")


class DatabaseJournalStore:
    """The journals of one robot's runs, by task; a `roboglot.programs.stores.JournalStore`."""

    def __init__(self, database: Transactions, robot: str) -> None:
        self._database = database
        self._robot = robot

    async def begin(self, id: str, header: str) -> None:
        """Start an empty journal in place of any earlier one."""

        def work(connection: Connection) -> None:
            self._remove(connection, [id])
            connection.execute("INSERT INTO program_run VALUES (?, ?, ?)", (self._robot, id, header))

        await self._run(work)

    async def write(self, id: str, entries: Sequence[JournalEntry]) -> None:
        """Add entries; one with a known number replaces the earlier one."""
        rows = [(self._robot, id, entry.seq, entry.name, entry.answer) for entry in entries]
        query = (
            "INSERT INTO program_call (robot, id, seq, name, answer) VALUES (?, ?, ?, ?, ?)"
            " ON CONFLICT (robot, id, seq) DO UPDATE SET name=excluded.name, answer=excluded.answer"
        )

        def work(connection: Connection) -> None:
            connection.executemany(query, rows)

        with store_errors():
            await self._database.run_together(work)

    async def remove(self, id: str) -> None:
        """Delete a journal."""
        with store_errors():
            await self._database.on(None).run_together(lambda connection: self._remove(connection, [id]))

    async def entries(self, id: str) -> list[JournalEntry]:
        """Return all calls in order."""
        query = "SELECT seq, name, answer FROM program_call WHERE robot=? AND id=? ORDER BY seq"
        return await self._run(
            lambda connection: [JournalEntry(*row) for row in connection.execute(query, (self._robot, id))]
        )

    def headers_now(self) -> dict[str, str]:
        """Return the headers of all journals by task; for start-up."""
        query = "SELECT id, header FROM program_run WHERE robot=? ORDER BY id"
        return self._run_now(lambda connection: dict(connection.execute(query, (self._robot,)).fetchall()))

    def remove_now(self, ids: Collection[str]) -> None:
        """Delete journals; for start-up."""
        self._run_now(lambda connection: self._remove(connection, ids))

    async def _run(self, work: Callable[[Connection], T]) -> T:
        with store_errors():
            return await self._database.run_together(work)

    def _run_now(self, work: Callable[[Connection], T]) -> T:
        with store_errors():
            return self._database.run_now(work)

    def _remove(self, connection: Connection, ids: Collection[str]) -> None:
        for table in ("program_run", "program_call"):
            connection.executemany(f"DELETE FROM {table} WHERE robot=? AND id=?", [(self._robot, id) for id in ids])
