"""Sync of a Slamware robot's map entries with those kept here, also after a lost link or another map."""

from __future__ import annotations

import asyncio
import uuid
from dataclasses import replace

import numpy as np
import pytest

from roboglot.model.components.mapping.annotations import Area, AreaKind, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.errors import InvalidGoal
from roboglot.model.events import MapReplaced
from roboglot.model.geometry import ORIGIN, Point, Pose
from roboglot.model.maps import OccupancyGrid, PointOfInterest
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.testing import Forward
from roboglot.wire.slamware.chapters.artifact import Line, LineUsage
from roboglot.wire.slamware.geometry import Point as GPoint
from tests.drivers.clients import Drive, OpenRest, Until

pytestmark = pytest.mark.world("office")


def place(name: str, x: float = 1.0) -> PointOfInterest:
    return PointOfInterest(str(uuid.uuid5(uuid.NAMESPACE_OID, name)), Pose(x, 2.0, 0.5), {"display_name": name})


def same(one: Robot, other: Robot) -> bool:
    return {p.id: p for p in one[Places].all()} == {p.id: p for p in other[Places].all()}


async def test_changes_on_either_side_reach_the_other(
    robot: Robot, slamware_door: SlamwareDoor, drive: Drive, until: Until, forward: Forward
) -> None:
    far = robot[Places]
    await far.put(place("kitchen"), place("hall"))
    await forward(seconds=2)
    driven = await drive(f"slamware://127.0.0.1:{slamware_door.port}")
    near = driven[Places]
    await until(lambda: same(driven, robot))
    assert len(near.all()) == 2
    await near.put(place("desk"), place("hall", x=3.0))
    await until(lambda: same(driven, robot) and len(far.all()) == 3, patience=1)  # at once
    await far.remove(place("kitchen").id)
    await until(lambda: len(near.all()) == 2)
    await near.remove(place("desk").id)
    await until(lambda: len(far.all()) == 1, patience=1)
    assert far.all()[0].pose.x == 3.0
    # Without a link both sides change; afterwards both have every entry, and where they differ the robot's counts.
    await slamware_door.close()
    await until(lambda: driven[Link].state is LinkState.LOST)
    await near.put(place("away"), place("hall", x=7.0))
    await far.put(place("there"), place("hall", x=8.0))
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=slamware_door.port))
    await door.start()
    await until(lambda: driven[Link].state is LinkState.UP)
    await until(lambda: same(driven, robot))
    assert {p.metadata["display_name"]: p.pose.x for p in near.all()} == {"hall": 8.0, "away": 1.0, "there": 1.0}
    await door.close()


async def test_map_is_loaded_through_the_door_with_places(
    robot: Robot, driven: Robot, rest: OpenRest, until: Until, forward: Forward
) -> None:
    dashboard = await rest(driven)
    await driven[Places].put(place("kitchen"))
    await until(lambda: len(robot[Places].all()) == 1)
    await until(lambda: (driven[Mapping].grid.log_odds > 0).sum() > 100)
    asked = asyncio.ensure_future(dashboard.get_composite_map())
    await until(asked.done)
    saved = await asked
    walls = int((robot[Mapping].grid.log_odds > 0).sum())
    assert walls > 100
    await driven[Places].clear()
    await driven[Places].put(place("elsewhere"))
    await until(lambda: [p.metadata["display_name"] for p in robot[Places].all()] == ["elsewhere"])
    robot[Mapping].clear()  # moves the drawings: while those of the driver are on their way, it can bring back old ones
    loading = asyncio.ensure_future(dashboard.set_composite_map(saved))
    await until(loading.done)
    await loading
    await until(lambda: [p.metadata["display_name"] for p in robot[Places].all()] == ["kitchen"])
    await forward(seconds=4)
    assert same(driven, robot)
    assert (robot[Mapping].grid.log_odds > 0).sum() == pytest.approx(walls, rel=0.2)


@pytest.mark.slow  # in short: test_changes_on_either_side_reach_the_other
async def test_walls_and_areas_are_heeded_by_the_robot(
    robot: Robot, driven: Robot, rest: OpenRest, until: Until, forward: Forward
) -> None:
    near, far = driven[MapAnnotations], robot[MapAnnotations]

    def drawn(there: MapAnnotations) -> set[tuple[str, float, float]]:
        now = there.current
        lines = {(str(each.kind), each.start.x, each.end.y) for each in now.lines}
        return lines | {(str(each.kind), each.start.x, each.end.y) for each in now.areas}

    dashboard = await rest(driven)
    asked = asyncio.ensure_future(dashboard.add_lines(LineUsage.WALLS, [Line(GPoint(1.0, -1.0), GPoint(1.0, 1.0))]))
    await until(asked.done)
    await until(lambda: drawn(far) == {("wall", 1.0, 1.0)}, patience=1)
    area = Area(0, AreaKind.DANGEROUS, Point(2, 0), Point(3, 0.5), 0.25, metadata={"max_line_speed": "0.2"})
    await far.change(lambda now: now.with_new(area))
    await until(lambda: drawn(near) == drawn(far), patience=6)
    assert near.current.areas[0].speed_max == pytest.approx(0.2)
    (wall,) = near.current.lines
    asked = asyncio.ensure_future(dashboard.remove_line_by_id(LineUsage.WALLS, wall.id))
    await until(asked.done)
    await until(lambda: drawn(far) == {("dangerous", 2.0, 0.5)}, patience=1)
    await forward(seconds=6)
    assert drawn(near) == drawn(far)
    driven[Mapping].load(driven[Mapping].grid, Pose())  # clears the drawings on the robot's map
    await forward(seconds=3)
    assert drawn(near) == drawn(far) == {("dangerous", 2.0, 0.5)}


async def test_merged_map_keeps_docks_and_landmarks(
    robot: Robot, driven: Robot, until: Until, forward: Forward
) -> None:
    dock, mark = place("dock", x=0.5), place("reflector", x=2.0)
    await robot[MapAnnotations].change(lambda now: replace(now, docks=(dock,), landmarks=(mark,)))
    await driven[Places].put(place("kitchen"))
    await until(lambda: len(robot[Places].all()) == 1 and bool(driven[Mapping].grid.log_odds.any()))
    heard, grid = driven.events.subscribe(MapReplaced), driven[Mapping].grid
    cells = np.pad(grid.log_odds, ((0, 0), (0, 40)))
    cells[10:20, -1] = 100  # of the map that is added
    driven[Mapping].load(OccupancyGrid(cells, grid.resolution, grid.origin), driven[Localization].pose, origin=ORIGIN)
    await until(lambda: robot[Mapping].grid.width == cells.shape[1], patience=5)
    await forward(seconds=3)
    notes = robot[MapAnnotations].current
    assert [[mark.id for mark in marks] for marks in (notes.docks, notes.landmarks)] == [[dock.id], [mark.id]]
    assert notes.docks[0].pose.distance_to(dock.pose) < 1e-5
    assert [p.metadata["display_name"] for p in robot[Places].all()] == ["kitchen"]
    assert same(driven, robot)
    assert [event.origin for event in heard.drain()] == [ORIGIN]
    with pytest.raises(InvalidGoal, match="the same origin"):
        driven[Mapping].load(grid, Pose(), origin=Pose(1.0))
