"""Acknowledged data is there again, also after kill -9."""

from __future__ import annotations

import asyncio
import signal
import sqlite3
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from threading import Barrier, Event

import numpy as np
import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.map_library import Label, StoredMap
from roboglot.model.errors import NotFound
from roboglot.model.events import EventStream, PlacesChanged
from roboglot.model.geodesy import GlobeAnchor
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid, PointOfInterest
from roboglot.storage.database import ROBOTS, Database, _migrate, connect
from roboglot.storage.maps import StoredMaps
from roboglot.storage.places import StoredPlaces
from roboglot.storage.settings import StoredSettings
from roboglot.storage.transactions import Connection
from roboglot.testing.process import child

Open = Callable[[], Database]
PROGRAMS = 6  # that start at once


@pytest.fixture
async def open_database(tmp_path: Path) -> AsyncIterator[Open]:
    opened: list[Database] = []

    def open_() -> Database:
        opened.append(Database(tmp_path / "robot.db"))
        return opened[-1]

    yield open_
    for database in opened:
        database.close()


def places(database: Database, robot: str = "a") -> StoredPlaces:
    return StoredPlaces(database, robot, LockstepClock(), EventStream())


@pytest.mark.parametrize("schema", [ROBOTS, "roboglot.storage.schema.access"])
def test_programs_may_open_a_new_file_at_once(schema: str, tmp_path: Path) -> None:
    together = Barrier(PROGRAMS)

    def open_new() -> int:
        together.wait()
        with closing(connect(tmp_path / "new.db", schema)) as connection:
            return int(connection.execute("PRAGMA user_version").fetchone()[0])

    with ThreadPoolExecutor(PROGRAMS) as programs:
        versions = [opening.result() for opening in [programs.submit(open_new) for _ in range(PROGRAMS)]]
    assert min(versions) == max(versions) > 0


@pytest.mark.parametrize("schema", [ROBOTS, *(f"{ROBOTS}.{name}" for name in ("access", "audit", "sessions"))])
def test_new_file_equals_one_of_all_versions(schema: str, tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / "old.db", isolation_level=None)) as old:
        _migrate(old, schema, in_steps=True)
        with closing(connect(tmp_path / "new.db", schema)) as new:
            for wanted in ("PRAGMA user_version", "SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY name"):
                assert new.execute(wanted).fetchall() == old.execute(wanted).fetchall() != []
            assert list(new.iterdump()) == list(old.iterdump())


async def test_places_come_back_in_order_and_per_robot(open_database: Open) -> None:
    first = places(open_database())
    await first.put(PointOfInterest("b", Pose(1, 2, 3), {"display_name": "desk", "odd": "厨房"}))
    await first.put(PointOfInterest("a", Pose(), {}))
    await first.put(PointOfInterest("b", Pose(4, 5, 6), {"display_name": "desk"}))
    again = places(open_database())
    assert [p.id for p in again.all()] == ["b", "a"]
    assert again.get("b") == PointOfInterest("b", Pose(4, 5, 6), {"display_name": "desk"})
    assert places(open_database(), "other").all() == ()


async def test_removing_what_is_not_there_is_an_error(open_database: Open) -> None:
    stored = places(open_database())
    with pytest.raises(NotFound):
        await stored.remove("unknown")
    await stored.put(PointOfInterest("x", Pose(), {}))
    await stored.remove("x")
    assert places(open_database()).all() == ()


async def test_every_change_is_reported(open_database: Open) -> None:
    events = EventStream()
    stored = StoredPlaces(open_database(), "a", LockstepClock(), events)
    with events.subscribe(PlacesChanged) as reported:
        await stored.put(PointOfInterest("x", Pose(), {}))
        await stored.clear()
        assert len(reported.drain()) == 2


async def test_maps_come_back_cell_by_cell(open_database: Open) -> None:
    cells = np.arange(-60, 60, dtype=np.int8).reshape(8, 15)
    saved = StoredMap("hall", OccupancyGrid(cells, 0.05, Point(-1, 2)), 12.5, (Label("door", Point(1, 2), "exit"),))
    saved = replace(saved, outdoor=True, number=2**64 - 1, anchor=GlobeAnchor(Point(1, 2), 39.9, 116.4, 1.5))
    await StoredMaps(open_database(), "a").put(saved)
    await StoredMaps(open_database(), "a").put(replace(saved, name="room", outdoor=False, number=0, anchor=None))
    loaded = await StoredMaps(open_database(), "a").get("hall")
    assert np.array_equal(loaded.grid.log_odds, cells)
    assert (loaded.grid.resolution, loaded.grid.origin) == (0.05, Point(-1, 2))
    assert (loaded.labels, loaded.saved_at) == (saved.labels, 12.5)
    assert (loaded.outdoor, loaded.number, loaded.anchor) == (True, 2**64 - 1, saved.anchor)
    maps = StoredMaps(open_database(), "a")
    assert list(await maps.names()) == ["hall", "room"]
    assert list(await maps.names(outdoor=True)) == ["hall"]
    assert list(await maps.names(number=2**64 - 1)) == ["hall"]
    assert list(await maps.names(outdoor=False, number=5)) == []
    await StoredMaps(open_database(), "a").remove("hall")
    with pytest.raises(NotFound):
        await StoredMaps(open_database(), "a").get("hall")


async def test_settings_come_back(open_database: Open) -> None:
    await StoredSettings(open_database(), "a").put("k", {"n": [1, None, "x"]})
    assert StoredSettings(open_database(), "a").get("k") == {"n": [1, None, "x"]}
    assert StoredSettings(open_database(), "b").get("k", 7) == 7


async def test_a_failed_transaction_leaves_nothing(open_database: Open) -> None:
    database = open_database()

    def half(connection: Connection) -> None:
        connection.execute("INSERT INTO setting VALUES ('a', 'k', '1')")
        raise RuntimeError("half way")

    with pytest.raises(RuntimeError):
        await database.run(half)
    assert StoredSettings(open_database(), "a").get("k") is None


async def test_transactions_together_share_a_flush_and_no_failure(open_database: Open) -> None:
    database, done = open_database(), list[int]()

    def write(number: int) -> Callable[[Connection], None]:
        def work(connection: Connection) -> None:
            connection.execute("INSERT INTO setting VALUES ('a', ?, '1')", (f"k{number}",))
            if number % 7 == 3:
                raise RuntimeError("this one breaks")
            done.append(number)

        return work

    def trace(connection: Connection, callback: Callable[[str], object] | None) -> None:
        assert isinstance(connection, sqlite3.Connection)
        connection.set_trace_callback(callback)

    commits: list[bool] = []
    await database.run(lambda connection: trace(connection, lambda sql: commits.append(sql == "COMMIT")))
    results = await asyncio.gather(*(database.run_together(write(n)) for n in range(40)), return_exceptions=True)
    await database.run(lambda connection: trace(connection, None))
    assert [n for n, result in enumerate(results) if isinstance(result, RuntimeError)] == list(range(3, 40, 7))
    settings = StoredSettings(open_database(), "a")
    assert [n for n in range(40) if settings.get(f"k{n}") is not None] == done
    assert sum(commits) < 10


async def test_a_database_of_a_newer_program_is_refused(tmp_path: Path) -> None:
    connection = sqlite3.connect(tmp_path / "robot.db")
    connection.execute("PRAGMA user_version=999")
    connection.close()
    with pytest.raises(ValueError, match="use a newer one"):
        Database(tmp_path / "robot.db")


WRITER = """
# warm
import asyncio, sys
from roboglot.storage.database import Database
from roboglot.storage.settings import StoredSettings
async def main():
    settings = StoredSettings(Database(sys.argv[1]), "a")
    for n in range(1_000_000):
        await settings.put("n", n)
        print(n, flush=True)
asyncio.run(main())
"""


def test_acknowledged_data_survives_kill_9(tmp_path: Path) -> None:
    path = tmp_path / "robot.db"
    for acknowledge in (1, 7, 23):
        with child(WRITER, str(path)) as writer:
            assert writer.stdout
            for _ in range(acknowledge):
                last = int(writer.stdout.readline())
            writer.send_signal(signal.SIGKILL)
            rest = writer.stdout.read().split()
        last = int(rest[-1]) if rest else last
        database = Database(path)
        assert StoredSettings(database, "a").get("n") in (last, last + 1)
        database.close()


async def test_in_memory_no_robot_time_passes(clock: LockstepClock) -> None:
    database, stamps = Database(":memory:"), []

    async def keep() -> None:
        await clock.sleep(0.5)
        for _ in range(3):
            await database.run(lambda connection: Event().wait(0.02) or connection.execute("SELECT 1").fetchone())
            stamps.append(clock.time())

    task = asyncio.create_task(keep())
    for step in range(1, 200):
        clock.call_at(step / 100, lambda: None)
    await clock.advance(2.0)
    await task
    database.close()
    assert stamps == [0.5] * 3
