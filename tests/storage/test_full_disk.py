"""A robot whose disk is full reads and deletes what it has, and keeps nothing new; the others do not notice."""

import logging
from pathlib import Path

import pytest

from roboglot.model.components.mapping.places import Places
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import Refused
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.storage.database import Database
from roboglot.storage.transactions import DiskFull


@pytest.mark.world("empty", robots=("a", "b"))
async def test_writing_is_refused_until_there_is_room_again(fleet, world):
    first, second = fleet.robots["a"][Settings], fleet.robots["b"][Settings]
    await first.put("kept", 1)
    (fault,) = world.faults.inject("full_disk", "a")
    with pytest.raises(Refused, match="disk is full"):
        await first.put("kept", 2)
    with pytest.raises(Refused, match="disk is full"):
        await fleet.robots["a"][Places].put(PointOfInterest("new", Pose()))
    assert first.get("kept") == 1
    await second.put("kept", 3)
    assert second.get("kept") == 3
    world.faults.clear(fault.number)
    await first.put("kept", 4)
    assert first.get("kept") == 4


async def test_database_on_a_full_disk_refuses_and_recovers(tmp_path: Path) -> None:
    database = Database(tmp_path / "small.db")
    database.run_now(lambda one: one.execute("CREATE TABLE kept (bytes BLOB)"))
    pages = database.run_now(lambda one: one.execute("PRAGMA page_count").fetchone()[0])
    database.run_now(lambda one: one.execute(f"PRAGMA max_page_count={pages}").fetchone())
    with pytest.raises(DiskFull, match="the disk is full"):
        await database.run(lambda one: one.execute("INSERT INTO kept VALUES (zeroblob(100000))"))
    database.run_now(lambda one: one.execute(f"PRAGMA max_page_count={pages + 100}").fetchone())
    await database.run(lambda one: one.execute("INSERT INTO kept VALUES (zeroblob(100000))"))
    assert await database.read(lambda one: one.execute("SELECT count(*) FROM kept").fetchone()[0]) == 1
    database.close()


@pytest.mark.world("empty")
async def test_background_writes_only_leave_a_log_line(fleet, world, caplog: pytest.LogCaptureFixture) -> None:
    world.faults.inject("full_disk", "a")
    with caplog.at_level(logging.WARNING):
        await fleet.robots["a"][Settings].keep("slamware.totals", [1.0, 2.0])
    assert "cannot store slamware.totals: the disk is full" in caplog.text
