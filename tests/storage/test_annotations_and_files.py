"""Annotations and files come back from another opening of the same database, whole and per robot."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping import annotations as model
from roboglot.model.components.mapping.annotations import (
    Annotations,
    Area,
    AreaKind,
    Line,
    LineKind,
)
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.events import AnnotationsChanged, EventStream
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import PointOfInterest
from roboglot.storage.annotations import StoredAnnotations
from roboglot.storage.database import Database
from roboglot.storage.files import StoredFiles

CURVE = Line(0, LineKind.TRACK, Point(1, 2), Point(3, 4), (Point(5, 6), Point(7, 8)), {"route": "七"})
ICE = Area(0, AreaKind.DANGEROUS, Point(0, 0), Point(1, 0), 2.0, speed_max=0.3, sensors=frozenset({"cliff"}))


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    opened = Database(tmp_path / "robot.db")
    yield opened
    opened.close()


def stored_in(database: Database, robot: str = "a", events: EventStream | None = None) -> StoredAnnotations:
    return StoredAnnotations(database, robot, LockstepClock(), events or EventStream())


async def test_everything_drawn_comes_back(database: Database) -> None:
    dock = PointOfInterest("d", Pose(1, 2, 3), {"display_name": "home"})
    await stored_in(database).change(lambda now: replace(now.with_new(CURVE, ICE), docks=(dock,)))
    again = stored_in(database).current
    assert again == Annotations((replace(CURVE, id=1),), (replace(ICE, id=2),), (dock,), last_id=2)
    assert stored_in(database, "other").current == Annotations()


async def test_changes_at_the_same_time_all_count(database: Database) -> None:
    events = EventStream()
    stored = stored_in(database, events=events)
    with events.subscribe(AnnotationsChanged) as heard:
        await asyncio.gather(*(stored.change(lambda now: now.with_new(CURVE)) for _ in range(5)))
        assert len(heard.drain()) == 5
    assert [line.id for line in stored.current.lines] == [1, 2, 3, 4, 5]


async def test_a_refused_change_leaves_everything(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model, "AREAS_MAX", 1)
    stored = stored_in(database)
    await stored.change(lambda now: now.with_new(ICE))
    before = stored.current
    with pytest.raises(InvalidGoal, match="more than 1 areas"):
        await stored.change(lambda now: now.with_new(ICE))

    def fail(_: Annotations) -> Annotations:
        raise NotFound("no line 7")

    with pytest.raises(NotFound):
        await stored.change(fail)
    assert stored.current is before


async def test_curves_longer_than_a_map_are_refused(database: Database) -> None:
    """The console and plans compute each of their points."""
    stored = stored_in(database)
    far = Line(0, LineKind.TRACK, Point(), Point(1, 0), (Point(1e5, 0), Point(0, 1e5)))
    assert far.points()[0] == far.start
    assert far.points()[-1] == far.end
    with pytest.raises(InvalidGoal, match="more than 100000 points"):
        await stored.change(lambda now: now.with_new(*[far] * 100))
    assert stored.current == Annotations()
    await stored.change(lambda now: now.with_new(*[CURVE] * 500))


async def test_files_keep_every_byte(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    files = StoredFiles(database, "a", LockstepClock())
    await files.write("map", bytes(range(256)))
    await files.write("map", b"\x00new")
    await files.write("another", b"")
    assert await files.names() == ["another", "map"]
    assert await files.read("map") == b"\x00new"
    with pytest.raises(NotFound):
        await StoredFiles(database, "b", LockstepClock()).read("map")
    await files.remove("map")
    with pytest.raises(NotFound):
        await files.remove("map")
    monkeypatch.setattr("roboglot.storage.files.FILE_BYTES_MAX", 3)
    with pytest.raises(InvalidGoal):
        await files.write("map", b"four")
