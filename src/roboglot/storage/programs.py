"""Programs and their logs in a database. States are opaque words here."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import astuple
from typing import TypeVar

from roboglot.programs.stores import LOG_MAX, LOG_TEXT_MAX, ListedProgram, LogEntry, StoredProgram, Stores
from roboglot.storage.journals import DatabaseJournalStore
from roboglot.storage.program_errors import store_errors
from roboglot.storage.transactions import Connection, Transactions

T = TypeVar("T")

_COLUMNS = "id, describe, style, mode, condition, body, state, due, owner"
_REPLACED = ", ".join(f"{name}=excluded.{name}" for name in _COLUMNS.split(", ") if name != "id")
_LISTED = "id, describe, style, mode, condition, state"


def program_stores(database: Transactions, robot: str) -> Stores:
    """Return the stores of one robot's programs."""
    return Stores(
        DatabaseProgramStore(database, robot),
        DatabaseProgramStore(database, robot, "module"),
        DatabaseJournalStore(database, robot),
    )


class DatabaseProgramStore:
    """The tasks of one robot, or with ``kind="module"`` its modules; a `roboglot.programs.stores.ProgramStore`."""

    def __init__(self, database: Transactions, robot: str, kind: str = "task") -> None:
        self._database = database
        self._key = (robot, kind)

    async def get(self, id: str) -> StoredProgram | None:
        """Return the program with this id, or None."""
        query = f"SELECT {_COLUMNS} FROM program WHERE robot=? AND kind=? AND id=?"
        row = await self._read(lambda connection: connection.execute(query, (*self._key, id)).fetchone())
        return StoredProgram(*row) if row else None

    async def all(self, ids: Collection[str] = ()) -> list[ListedProgram]:
        """Return those of ``ids`` that exist, or all if ``ids`` is empty; by id, ascending."""

        def work(connection: Connection) -> list[ListedProgram]:
            query = f"SELECT {_LISTED} FROM program WHERE robot=? AND kind=?"
            if ids:
                found = (
                    connection.execute(f"{query} AND id=?", (*self._key, id)).fetchone() for id in sorted(set(ids))
                )
                rows = [row for row in found if row]
            else:
                rows = connection.execute(f"{query} ORDER BY id", self._key).fetchall()
            uses, used_by = self._uses(connection)
            return [ListedProgram(*row, *(tuple(by.get(row[0], ())) for by in (uses, used_by))) for row in rows]

        return await self._read(work)

    async def count(self) -> int:
        """Return the number of programs."""

        def work(connection: Connection) -> int:
            query = "SELECT COUNT(*) FROM program WHERE robot=? AND kind=?"
            return int(connection.execute(query, self._key).fetchone()[0])

        return await self._read(work)

    async def put(self, program: StoredProgram, uses: Collection[str] | None = None) -> None:
        """Add a program or replace the one with the same id; ``uses``: the modules it calls, None: unchanged."""

        def work(connection: Connection) -> None:
            connection.execute(
                f"INSERT INTO program (robot, kind, {_COLUMNS}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
                f" ON CONFLICT (robot, kind, id) DO UPDATE SET {_REPLACED}",
                (*self._key, *astuple(program)),
            )
            if uses is not None:
                self._forget_uses(connection, program.id)
                rows = [(*self._key, program.id, module) for module in set(uses)]
                connection.executemany("INSERT INTO program_use (robot, kind, id, module) VALUES (?, ?, ?, ?)", rows)

        await self._run(work)

    def names_now(self) -> list[tuple[str, str, str, frozenset[str]]]:
        """Return id, condition, state and used modules of all programs; for start-up."""

        def work(connection: Connection) -> list[tuple[str, str, str, frozenset[str]]]:
            uses, _ = self._uses(connection)
            query = "SELECT id, condition, state FROM program WHERE robot=? AND kind=? ORDER BY id"
            return [(*row, frozenset(uses.get(row[0], ()))) for row in connection.execute(query, self._key)]

        return self._run_now(work)

    async def used_by(self, module: str) -> list[str]:
        """Return the ids of the tasks and modules that call ``module``, in order."""
        query = "SELECT DISTINCT id FROM program_use WHERE robot=? AND module=? ORDER BY id"
        key = (self._key[0], module)
        return await self._read(lambda connection: [id for (id,) in connection.execute(query, key)])

    async def uses(self, id: str) -> list[str]:
        """Return the ids of the modules that a program calls directly, in order."""
        query = "SELECT module FROM program_use WHERE robot=? AND kind=? AND id=? ORDER BY module"
        key = (*self._key, id)
        return await self._read(lambda connection: [module for (module,) in connection.execute(query, key)])

    async def set_state(self, id: str, state: str, log: Sequence[LogEntry] = ()) -> None:
        """Change the state and append to the log in one transaction."""

        def work(connection: Connection) -> None:
            self._set_states(connection, {id: state})
            self._append(connection, id, log)

        await self._run(work)

    def settle_now(self, states: Mapping[str, str], note: LogEntry) -> None:
        """Change states by id and append the same note to each log; for start-up."""

        def work(connection: Connection) -> None:
            self._set_states(connection, states)
            for id in states:
                self._append(connection, id, [note])

        self._run_now(work)

    def in_states_now(self, states: Collection[str]) -> list[StoredProgram]:
        """Return all programs in one of these states, by id; for start-up."""
        if not states:
            return []
        marks = ", ".join("?" * len(states))
        query = f"SELECT {_COLUMNS} FROM program WHERE robot=? AND kind=? AND state IN ({marks}) ORDER BY id"
        return self._run_now(
            lambda connection: [StoredProgram(*row) for row in connection.execute(query, (*self._key, *states))]
        )

    async def remove(self, id: str) -> None:
        """Delete a program and its log; do nothing if there is none."""

        def work(connection: Connection) -> None:
            connection.execute("DELETE FROM program WHERE robot=? AND kind=? AND id=?", (*self._key, id))
            connection.execute("DELETE FROM program_log WHERE robot=? AND kind=? AND id=?", (*self._key, id))
            self._forget_uses(connection, id)

        with store_errors():
            await self._database.remove(work)

    async def append_log(self, id: str, entries: Sequence[LogEntry]) -> None:
        """Append entries to a program's log."""
        await self._run(lambda connection: self._append(connection, id, entries))

    async def log(self, id: str) -> list[LogEntry]:
        """Return the newest ``LOG_MAX`` entries, oldest first."""
        query = "SELECT at, level, text FROM program_log WHERE robot=? AND kind=? AND id=? ORDER BY seq"
        return await self._read(
            lambda connection: [LogEntry(*row) for row in connection.execute(query, (*self._key, id))]
        )

    async def _run(self, work: Callable[[Connection], T]) -> T:
        with store_errors():
            return await self._database.run_together(work)

    async def _read(self, work: Callable[[Connection], T]) -> T:
        with store_errors():
            return await self._database.read(work)

    def _run_now(self, work: Callable[[Connection], T]) -> T:
        with store_errors():
            return self._database.run_now(work)

    def _uses(self, connection: Connection) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
        """Return called modules by caller and, for modules, callers by module."""
        robot, kind = self._key
        uses: dict[str, list[str]] = {}
        used_by: dict[str, list[str]] = {}
        query = "SELECT kind, id, module FROM program_use WHERE robot=? ORDER BY id, module"
        for caller, id, module in connection.execute(query, (robot,)):
            if caller == kind:
                uses.setdefault(id, []).append(module)
            if kind == "module" and id not in (callers := used_by.setdefault(module, [])):
                callers.append(id)  # a task and a module may share an id
        return uses, used_by

    def _forget_uses(self, connection: Connection, id: str) -> None:
        connection.execute("DELETE FROM program_use WHERE robot=? AND kind=? AND id=?", (*self._key, id))

    def _set_states(self, connection: Connection, states: Mapping[str, str]) -> None:
        rows = [(state, *self._key, id) for id, state in states.items()]
        connection.executemany("UPDATE program SET state=? WHERE robot=? AND kind=? AND id=?", rows)

    def _append(self, connection: Connection, id: str, entries: Iterable[LogEntry]) -> None:
        rows = [(*self._key, id, entry.at, entry.level, entry.text[:LOG_TEXT_MAX]) for entry in entries]
        if not rows:
            return
        connection.executemany(
            "INSERT INTO program_log (robot, kind, id, at, level, text) VALUES (?, ?, ?, ?, ?, ?)", rows
        )
        connection.execute(
            "DELETE FROM program_log WHERE robot=? AND kind=? AND id=? AND seq <= (SELECT seq FROM program_log"
            " WHERE robot=? AND kind=? AND id=? ORDER BY seq DESC LIMIT 1 OFFSET ?)",
            (*self._key, id, *self._key, id, LOG_MAX),
        )
