"""Entries that change on both sides between two syncs, in any order: deleted ones stay so, and both sides agree."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from roboglot.drivers.entry_sync import EntrySync
from roboglot.drivers.local_entries import LocalDrawings, LocalPlaces, key_of
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.annotations import Line, LineKind, MapAnnotations
from roboglot.model.components.mapping.places import Places
from roboglot.model.events import PlacesChanged
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.storage.annotations import StoredAnnotations
from roboglot.storage.database import Database
from roboglot.storage.places import StoredPlaces
from tests.protocols.slamware.conftest import PLATE

Step = tuple[str, str, int]  # the side, what it does, with which entry
NAMES = range(3)
steps = st.tuples(st.sampled_from(("near", "far")), st.sampled_from(("put", "drop", "drop")), st.sampled_from(NAMES))
others = st.sampled_from((("far", "clear", 0), ("", "sync", 0)))


class Side:
    """One side's entries."""

    def __init__(self, kind: str) -> None:
        self.entries: dict[Hashable, Any] = {}
        local: Any = LocalPlaces if kind == "places" else LocalDrawings
        self._key, self.moves, self.merge = KINDS[kind][2], local.moves, local.merge

    async def read(self) -> Mapping[Hashable, Any]:
        return dict(self.entries)

    async def write(self, put: Sequence[Any], gone: Sequence[Any]) -> Collection[Hashable]:
        for entry in put:
            self.entries[self._key(entry)] = entry
        for entry in gone:
            self.entries.pop(self._key(entry), None)
        return ()

    def drop(self, name: int) -> None:
        self.entries = {key: each for key, each in self.entries.items() if each.metadata["name"] != str(name)}

    def clear(self, moved: Callable[[Any], Any]) -> None:
        """Do what a robot does that clears its map: all entries are elsewhere."""
        self.entries = {self._key(entry): entry for entry in map(moved, self.entries.values())}

    @property
    def names(self) -> set[int]:
        return {int(entry.metadata["name"]) for entry in self.entries.values()}


def place(name: int, version: int) -> PointOfInterest:
    return PointOfInterest(str(name), Pose(version, 2.0), {"name": str(name), "version": str(version)})


def wall(name: int, version: int) -> Line:
    about = {"name": str(name), "version": str(version)}
    return Line(0, LineKind.WALL, Point(version, 0.0), Point(version, 2.0), metadata=about)


def moved_place(entry: PointOfInterest) -> PointOfInterest:
    return replace(entry, pose=Pose(entry.pose.x + 0.5, entry.pose.y))


def moved_wall(entry: Line) -> Line:
    start, end = (Point(point.x + 0.5, point.y) for point in (entry.start, entry.end))
    return replace(entry, start=start, end=end)


KINDS: dict[str, tuple[Any, Any, Any]] = {
    "places": (place, moved_place, lambda entry: entry.id),
    "drawings": (wall, moved_wall, key_of),
}


def after(kind: str, there: set[int], done: list[Step]) -> set[int]:
    """Return the names that both sides have after these steps and a sync."""
    last = {(side, name): what for side, what, name in done if what in ("put", "drop")}
    found = set()
    for name in NAMES:
        here, robot = last.get(("near", name)), last.get(("far", name))
        kept = name in there and here != "drop" and robot != "drop"
        put_here = here == "put" and (robot is None or kind == "drawings" or name not in there)
        if robot == "put" or put_here or kept:
            found.add(name)
    return found


async def play(kind: str, story: list[Step]) -> None:
    make, moved, key = KINDS[kind]
    near, far, expected, done = Side(kind), Side(kind), set[int](), list[Step]()
    robot = cast("Robot", SimpleNamespace(events=SimpleNamespace(listen=lambda *_: None)))
    sync = EntrySync(robot, cast("Supervisor", None), near, far, PlacesChanged, what=kind)
    for version, (side, what, name) in enumerate((*story, ("", "sync", 0))):
        mine = near if side == "near" else far
        if what == "sync":
            await sync.sync()
            expected, done = after(kind, expected, done), []
            assert near.entries == far.entries
            assert near.names == expected, story
        elif what == "clear":
            mine.clear(moved)
        else:
            mine.drop(name)
            if what == "put":
                entry = make(name, version)
                mine.entries[key(entry)] = entry
            done.append((side, what, name))
    before = dict(far.entries)
    await sync.sync()
    assert near.entries == far.entries == before


CLEARED: list[Step] = [
    ("near", "put", 0), ("near", "put", 1), ("", "sync", 0), ("near", "drop", 0), ("far", "clear", 0),
]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=20, deadline=None)
@example(CLEARED)
@given(st.lists(st.one_of(steps, steps, others), max_size=12))
def test_deleted_entries_stay_so(kind: str, story: list[Step]) -> None:
    asyncio.run(play(kind, story))


def walls(*xs: float, length: float = 2.0) -> dict[Hashable, Any]:
    found = [Line(0, LineKind.WALL, Point(x, 0.0), Point(x, length)) for x in xs]
    return {key_of(entry): entry for entry in found}


def test_walls_are_moved_only_together() -> None:
    before = walls(1.0, 2.0, 4.0)
    for now in (walls(11.0, 12.001, 14.0), walls(2.0, 3.0, 5.0)):  # one where another was
        assert LocalDrawings.moves(before, now) == dict(zip(before, now, strict=True))
    for other in (walls(11.0, 12.1, 14.0), walls(11.0, 12.0), walls(11.0, 12.0, 14.0, length=2.1)):
        assert LocalDrawings.moves(before, other) == {}


async def test_metadata_given_here_survive_a_clearing() -> None:
    near, far = Side("places"), Side("places")
    robot = cast("Robot", SimpleNamespace(events=SimpleNamespace(listen=lambda *_: None)))
    sync = EntrySync(robot, cast("Supervisor", None), near, far, PlacesChanged, what="places")
    near.entries = {str(name): place(name, 1) for name in NAMES}
    await sync.sync()
    near.entries["0"] = replace(near.entries["0"], metadata={"name": "0", "version": "mine"})
    near.entries["1"] = replace(near.entries["1"], pose=Pose(7.0, 7.0))  # on a map that is no more
    far.clear(moved_place)
    await sync.sync()
    assert near.entries == far.entries
    assert (far.entries["0"].metadata["version"], far.entries["0"].pose) == ("mine", Pose(1.5, 2.0))
    assert far.entries["1"] == moved_place(place(1, 1))


@pytest.mark.parametrize("kind", KINDS)
async def test_removals_under_way_hold_against_a_clearing(kind: str, clock: LockstepClock) -> None:
    make, moved, key = KINDS[kind]
    robot, database, far = Robot("a", PLATE, clock), Database(":memory:"), Side(kind)
    places = StoredPlaces(database, "a", clock, robot.events)
    drawn = StoredAnnotations(database, "a", clock, robot.events)
    robot.add(Places, places)
    robot.add(MapAnnotations, drawn)
    near: Any = LocalPlaces(robot) if kind == "places" else LocalDrawings(robot)
    link = cast("Supervisor", SimpleNamespace(link=SimpleNamespace(refusal="none is needed")))
    sync = EntrySync(robot, link, near, far, PlacesChanged, what=kind)
    far.entries = {key(entry): entry for entry in (make(0, 1), make(1, 2))}
    await sync.sync()
    assert len(await near.read()) == 2
    far.clear(moved)
    async with places.turn, drawn.turn:  # the removal waits for the database, and the sync for the removal
        if kind == "places":
            removing = asyncio.ensure_future(places.remove("0"))
        else:
            removing = asyncio.ensure_future(drawn.change(lambda now: replace(now, lines=now.lines[1:])))
        await asyncio.sleep(0)
        syncing = asyncio.ensure_future(sync.sync())
        for _ in range(5):
            await asyncio.sleep(0)
        assert len(await near.read()) == 2
    await syncing
    await removing
    assert [entry.metadata["name"] for entry in (await near.read()).values()] == ["1"]
    await sync.sync()
    assert far.names == {1}
    assert await near.read() == far.entries
    database.close()
