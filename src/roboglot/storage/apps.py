"""Installed apps in the database, with their packages, which take room on the robot's disk."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import BinaryIO

from roboglot.model.clock import Clock
from roboglot.model.components.system.apps import APP_BYTES_MAX, APPS_MAX, App, Apps
from roboglot.model.components.system.disk import Disk
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.storage.transactions import Connection, Transactions

NAME_MAX = 200  # characters
PIECE = 1 << 20  # bytes


class StoredApps(Apps):
    """The apps of one robot; ``disk`` accounts for their size."""

    def __init__(self, database: Transactions, robot: str, clock: Clock, disk: Disk) -> None:
        self._database, self._robot, self._clock, self._disk = database, robot, clock, disk
        self._turn = asyncio.Lock()  # of changes
        self._apps = {app.name: app for app in database.run_now(self._load)}
        for app in self._apps.values():
            disk.take(_place(app.name), app.size)

    def all(self) -> Sequence[App]:
        return [self._apps[name] for name in sorted(self._apps)]

    async def install(self, name: str, version: str, package: BinaryIO) -> App:
        size = package.seek(0, 2)
        if not name.isprintable() or not 0 < len(name) <= NAME_MAX or len(version) > NAME_MAX:
            raise InvalidGoal("an app has a name and a version that are not too long")
        if not 0 < size <= APP_BYTES_MAX:
            raise InvalidGoal(f"an app's package has 1 to {APP_BYTES_MAX} bytes")
        async with self._turn:
            return await self._install(name, version, package, size)

    async def _install(self, name: str, version: str, package: BinaryIO, size: int) -> App:
        if name not in self._apps and len(self._apps) >= APPS_MAX:
            raise InvalidGoal(f"more than {APPS_MAX} apps")
        before = self._apps.get(name)
        self._disk.take(_place(name), size)
        app = App(name, version, size, self._clock.epoch())
        try:
            await self._database.run(lambda connection: self._write(connection, app, package))
        except BaseException:
            self._disk.take(_place(name), before.size if before else 0)
            raise
        self._apps[name] = app
        return app

    def _write(self, connection: Connection, app: App, package: BinaryIO) -> None:
        """Write an app piece by piece, so that its package is never whole in memory."""
        connection.execute(
            "INSERT INTO app (robot, name, version, size, installed_at) VALUES (?, ?, ?, ?, ?)"
            " ON CONFLICT (robot, name) DO UPDATE SET version=excluded.version, size=excluded.size,"
            " installed_at=excluded.installed_at",
            (self._robot, app.name, app.version, app.size, app.installed_at),
        )
        connection.execute("DELETE FROM app_piece WHERE robot=? AND name=?", (self._robot, app.name))
        package.seek(0)
        for number, piece in enumerate(iter(lambda: package.read(PIECE), b"")):
            connection.execute(
                "INSERT INTO app_piece (robot, name, number, data) VALUES (?, ?, ?, ?)",
                (self._robot, app.name, number, piece),
            )

    async def remove(self, name: str) -> None:
        async with self._turn:
            if name not in self._apps:
                raise NotFound(f"no app is named {name!r}")
            await self._database.remove(lambda connection: self._delete(connection, name))
            self._apps.pop(name)
            self._disk.release(_place(name))

    def _delete(self, connection: Connection, name: str) -> None:
        for table in ("app", "app_piece"):
            connection.execute(f"DELETE FROM {table} WHERE robot=? AND name=?", (self._robot, name))

    def _load(self, connection: Connection) -> list[App]:
        rows = connection.execute("SELECT name, version, size, installed_at FROM app WHERE robot=?", (self._robot,))
        return [App(*row) for row in rows]


def _place(name: str) -> str:
    """Return the name of an app in the disk's accounts."""
    return f"app {name}"
