"""The map in use is replaced as a whole or not at all."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from msgspec.structs import astuple

from roboglot.fleet import UNKNOWN
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.annotations import Annotations, Area, AreaKind, Line, LineKind
from roboglot.model.components.mapping.map_memory import Drawings, Replacement, moved
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal, NotFound, Refused
from roboglot.model.events import MapReplaced
from roboglot.model.geometry import ORIGIN, Point, Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
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

    robot: Robot
    places: StoredPlaces
    annotations: StoredAnnotations
    settings: StoredSettings
    files: StoredFiles
    memory: StoredMapMemory


def parts(database: Database) -> Parts:
    robot = Robot("a", UNKNOWN, LockstepClock())
    events, clock = robot.events, robot.clock
    places, annotations = StoredPlaces(database, "a", clock, events), StoredAnnotations(database, "a", clock, events)
    settings, files = StoredSettings(database, "a"), StoredFiles(database, "a", clock)
    memory = StoredMapMemory(robot, database, places, annotations, settings, files)
    robot.add(Settings, settings)
    return Parts(robot, places, annotations, settings, files, memory)


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


CURVE = Line(0, LineKind.TRACK, Point(1, 1), Point(3, 1), (Point(1, 2), Point(3, 2)), {"route": "七"})
ICE = Area(0, AreaKind.DANGEROUS, Point(1, 1), Point(2, 1), 0.5)
DOCK, MARK = PointOfInterest("d", Pose(1, 1, 0), {}), PointOfInterest("m", Pose(0, 1, 0), {})


async def test_drawings_stay_under_moved_origin(database: Database) -> None:
    """No door is open that would care."""
    here = parts(database)
    await here.places.put(OLD)
    await here.annotations.change(lambda now: replace(now.with_new(CURVE, ICE), docks=(DOCK,), landmarks=(MARK,)))
    for origin in (Pose(1, 0, math.pi / 2), ORIGIN, None, Pose(0, 1)):
        here.robot.events.publish(MapReplaced(stamp=0.0, origin=origin))
    assert not here.memory.settled
    await asyncio.sleep(0)
    await here.places.put(NEW)  # on the new map
    await here.memory.settle()
    for seen in (here, parts(database)):
        old, new = seen.places.all()
        assert astuple(old.pose) == pytest.approx((2, -1, 3 - math.pi / 2))
        assert new == NEW
        (line,), (area,) = seen.annotations.current.lines, seen.annotations.current.areas
        assert line.control is not None
        spots = [line.start, line.end, *line.control, area.start, area.end]
        expected = [(1, -1), (1, -3), (2, -1), (2, -3), (1, -1), (1, -2)]
        assert [(round(p.x, 9), round(p.y, 9)) for p in spots] == expected
        assert line.metadata == CURVE.metadata
        (dock,), (mark,) = seen.annotations.current.docks, seen.annotations.current.landmarks
        assert astuple(dock.pose) == pytest.approx((1, -1, -math.pi / 2))
        assert astuple(mark.pose) == pytest.approx((1, 0, -math.pi / 2))
        assert astuple(moved(seen.robot)) == pytest.approx((0, 0, math.pi / 2))


async def test_door_with_more_to_store_moves_drawings(database: Database) -> None:
    here, moves = parts(database), list[Pose]()
    await here.places.put(OLD)

    async def mover(origin: Pose) -> None:
        moves.append(origin)

    here.memory.mover = mover
    here.robot.events.publish(MapReplaced(stamp=0.0, origin=OLD.pose))
    with here.memory.left_to_caller():
        here.robot.events.publish(MapReplaced(stamp=0.0, origin=NEW.pose))
    await here.memory.settle()
    assert (moves, here.places.get("old")) == ([OLD.pose], OLD)
    await here.memory.close()
    here.robot.events.publish(MapReplaced(stamp=0.0, origin=OLD.pose))
    await here.memory.settle()
    assert astuple(here.places.get("old").pose) == pytest.approx((0, 0, 0))


async def test_failed_move_of_drawings_is_logged(database: Database, caplog: pytest.LogCaptureFixture) -> None:
    here = parts(database)

    async def mover(_: Pose) -> None:
        raise Refused("the disk is full")

    here.memory.mover = mover
    here.robot.events.publish(MapReplaced(stamp=0.0, origin=OLD.pose))
    await here.memory.settle()
    assert caplog.messages == ["cannot move the drawings of robot a to the new map: the disk is full"]
