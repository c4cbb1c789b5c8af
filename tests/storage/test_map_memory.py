"""The map in use is replaced as a whole or not at all."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.annotations import Annotations, Line, LineKind
from roboglot.model.components.mapping.map_memory import Drawings, Replacement
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.events import EventStream
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import PointOfInterest
from roboglot.storage.annotations import StoredAnnotations
from roboglot.storage.database import Database
from roboglot.storage.files import StoredFiles
from roboglot.storage.map_memory import StoredMapMemory
from roboglot.storage.places import StoredPlaces
from roboglot.storage.settings import StoredSettings

WALL = Line(0, LineKind.WALL, Point(0, 0), Point(1, 0))
OLD, NEW = PointOfInterest("old", Pose(1, 2, 3), {}), PointOfInterest("new", Pose(3, 2, 1), {"a": "b"})


@dataclass
class Parts:
    """The stores as one start of the robot sees them."""

    places: StoredPlaces
    annotations: StoredAnnotations
    settings: StoredSettings
    files: StoredFiles
    memory: StoredMapMemory


def parts(database: Database) -> Parts:
    events, clock = EventStream(), LockstepClock()
    places, annotations = StoredPlaces(database, "a", clock, events), StoredAnnotations(database, "a", clock, events)
    settings, files = StoredSettings(database, "a"), StoredFiles(database, "a", clock)
    memory = StoredMapMemory(database, places, annotations, settings, files)
    return Parts(places, annotations, settings, files, memory)


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    opened = Database(tmp_path / "robot.db")
    yield opened
    opened.close()


async def test_drawings_are_new_at_once_and_after_start(database: Database) -> None:
    here = parts(database)
    await here.places.put(OLD)
    await here.files.write("gone", b"1")
    await here.annotations.change(lambda now: now.with_new(WALL, WALL, WALL))
    drawn = Annotations().with_new(WALL)
    new = Replacement(Drawings([NEW], drawn), {"k": [1]}, {"f": b"2", "gone": None})
    before = Drawings(here.places.all(), here.annotations.current)
    reported: list[Drawings] = []

    def edit(now: Drawings) -> Replacement:
        reported.append(now)
        return new

    await here.memory.replace(edit)
    assert reported == [before]
    for seen in (here, parts(database)):
        assert list(seen.places.all()) == [NEW]
        assert seen.annotations.current.lines == drawn.lines
        assert seen.annotations.current.last_id == 3  # ids are given once
        assert seen.settings.get("k") == [1]
        assert await seen.files.read("f") == b"2"
        with pytest.raises(NotFound):
            await seen.files.read("gone")


async def test_a_refusal_of_one_part_leaves_all(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    here = parts(database)
    await here.places.put(OLD)
    await here.files.write("f", b"1")
    monkeypatch.setattr("roboglot.storage.files.FILES_MAX", 1)  # noticed by the last write of the transaction
    new = Drawings([NEW], Annotations().with_new(WALL))
    with pytest.raises(InvalidGoal):
        await here.memory.replace(lambda _: Replacement(new, {"k": 1}, {"f": b"2", "g": b"3"}))
    for seen in (here, parts(database)):
        assert list(seen.places.all()) == [OLD]
        assert seen.annotations.current == Annotations()
        assert seen.settings.get("k") is None
        assert await seen.files.read("f") == b"1"


async def test_places_that_come_meanwhile_are_not_lost(database: Database) -> None:
    here = parts(database)
    put = asyncio.ensure_future(here.places.put(OLD))
    await asyncio.sleep(0)  # it is under way
    await here.memory.replace(lambda now: Replacement(Drawings([*now.places, NEW], now.annotations)))
    await put
    assert list(here.places.all()) == list(parts(database).places.all()) == [OLD, NEW]
