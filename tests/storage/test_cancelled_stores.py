"""A client that is gone while its change is stored: memory and disk agree all the same."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Coroutine
from pathlib import Path

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.events import EventStream
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.storage import postgresql
from roboglot.storage.database import Database
from roboglot.storage.members import StoredMembers
from roboglot.storage.opening import open_database
from roboglot.storage.places import StoredPlaces
from roboglot.storage.settings import StoredSettings
from roboglot.storage.transactions import Connection, DiskFull, Transactions
from tests.storage.postgresql_server import PostgreSQLServer, needs_postgresql

Work = Callable[[Connection], object]


class Held:
    """A database that holds back writing from ``cancelled`` on, until that has cancelled the writer."""

    def __init__(self, database: Transactions, monkeypatch: pytest.MonkeyPatch) -> None:
        self.database, self.failing, self.hanging = database, False, False
        self._patch = monkeypatch

    async def cancelled(self, change: Coroutine[object, object, object]) -> None:
        """Cancel ``change`` while it is written; return once it is."""
        loop, writing, go = asyncio.get_running_loop(), asyncio.Event(), threading.Event()
        transact: Callable[..., object] = vars(type(self.database))["_transact"]

        def wait(work: Work, **options: float) -> object:
            loop.call_soon_threadsafe(writing.set)
            assert go.wait(60.0)
            if self.failing:
                raise DiskFull("the disk is full")
            return transact(self.database, work, **options)

        with self._patch.context() as holding:
            holding.setattr(self.database, "_transact", wait)
            task = asyncio.ensure_future(change)
            await writing.wait()
            task.cancel()
            if not self.hanging:
                loop.call_later(0.01, go.set)
            with pytest.raises(asyncio.CancelledError):
                await task
            go.set()


@pytest.fixture
def held(database: Transactions, monkeypatch: pytest.MonkeyPatch) -> Held:
    return Held(database, monkeypatch)


async def test_member_of_a_client_that_left_is_listed(held: Held) -> None:
    """It could not be added again, either: "there is a member named 'eva' already"."""
    members = StoredMembers(held.database, "a", LockstepClock(), EventStream())
    await held.cancelled(members.add("eva"))
    assert [member.name for member in members.all()] == ["eva"]


async def test_cancelled_changes_count_in_memory_too(held: Held) -> None:
    places = StoredPlaces(held.database, "a", LockstepClock(), EventStream())
    await held.cancelled(places.put(PointOfInterest("dock", Pose())))
    assert [place.id for place in places.all()] == ["dock"]
    settings = StoredSettings(held.database, "a")
    await settings.put_all({"one": 1, "two": 2})
    assert settings.get("two") == StoredSettings(held.database, "a").get("two") == 2


async def test_cancelled_and_failed_change_leaves_memory(held: Held) -> None:
    held.failing = True
    settings = StoredSettings(held.database, "a")

    async def change() -> None:
        with pytest.raises(DiskFull):
            await settings.put("one", 1)

    await held.cancelled(change())
    assert settings.get("one") is None


@needs_postgresql
async def test_server_that_hangs_keeps_no_cancelled_task(
    db_server: PostgreSQLServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(postgresql, "OUTCOME_MAX", 0.01)
    database = open_database(tmp_path / "unused", db_server.url)
    held, settings = Held(database, monkeypatch), StoredSettings(database, "a")
    held.hanging = True
    await held.cancelled(settings.put("one", 1))
    assert settings.get("one") is None
    database.close()


async def test_time_that_is_up_stays_a_time_out(held: Held) -> None:
    settings = StoredSettings(held.database, "a")

    async def change() -> None:
        async with asyncio.timeout(0):
            await settings.put("one", 1)
            await asyncio.sleep(0)

    with pytest.raises(TimeoutError):
        await change()
    assert settings.get("one") == 1


def test_last_words_are_stored_at_loops_end(tmp_path: Path) -> None:
    """A loop cancels all tasks at its end, and waits for them: one that stored its last words waited forever."""
    database, go = Database(tmp_path / "robot.db"), threading.Event()

    def write(name: str) -> Work:
        return lambda connection: connection.execute("INSERT INTO setting VALUES ('a', ?, '1')", (name,))

    def slow(connection: Connection) -> None:
        assert go.wait(60.0)
        write("first")(connection)

    async def program() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            go.set()
            async with asyncio.timeout(60.0):
                await database.run_together(write("last words"))

    async def main() -> None:
        tasks = [asyncio.create_task(work) for work in (database.run_together(slow), program())]
        for _ in range(3):
            await asyncio.sleep(0)
        assert not any(task.done() for task in tasks)

    asyncio.run(main())
    settings = StoredSettings(database, "a")
    assert [settings.get(name) for name in ("first", "last words")] == [1, 1]
    database.close()
