"""Clients' files in the database."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from roboglot.model.clock import Clock
from roboglot.model.components.system.file_store import FILE_BYTES_MAX, FileStore
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.storage.transactions import Connection, Transactions

FILES_MAX = 100


class StoredFiles(FileStore):
    """The files of one robot."""

    def __init__(self, database: Transactions, robot: str, clock: Clock) -> None:
        self._database = database
        self._robot = robot
        self._clock = clock

    async def names(self) -> Sequence[str]:
        rows = await self._database.run(
            lambda c: c.execute("SELECT name FROM file WHERE robot=? ORDER BY name", (self._robot,)).fetchall()
        )
        return [name for (name,) in rows]

    async def read(self, name: str) -> bytes:
        row = await self._database.run(
            lambda c: c.execute("SELECT data FROM file WHERE robot=? AND name=?", (self._robot, name)).fetchone()
        )
        if row is None:
            raise NotFound(f"no file {name!r}")
        return bytes(row[0])

    async def write(self, name: str, data: bytes) -> None:
        await self._database.run(self.writing(name, data))

    def writing(self, name: str, data: bytes | None) -> Callable[[Connection], None]:
        """Return the transaction that writes a file or, for None, removes it. Raises InvalidGoal if it is too long."""
        if data is not None and len(data) > FILE_BYTES_MAX:
            raise InvalidGoal(f"a file has at most {FILE_BYTES_MAX} bytes")
        row = (self._robot, name, data, self._clock.epoch())

        def work(connection: Connection) -> None:
            if data is None:
                connection.execute("DELETE FROM file WHERE robot=? AND name=?", row[:2])
                return
            others = connection.execute("SELECT count(*) FROM file WHERE robot=? AND name<>?", row[:2]).fetchone()[0]
            if others >= FILES_MAX:
                raise InvalidGoal(f"more than {FILES_MAX} files")
            connection.execute(
                "INSERT INTO file (robot, name, data, saved_at) VALUES (?, ?, ?, ?)"
                " ON CONFLICT (robot, name) DO UPDATE SET data=excluded.data, saved_at=excluded.saved_at",
                row,
            )

        return work

    async def remove(self, name: str) -> None:
        removed = await self._database.remove(
            lambda c: c.execute("DELETE FROM file WHERE robot=? AND name=?", (self._robot, name)).rowcount
        )
        if not removed:
            raise NotFound(f"no file {name!r}")
