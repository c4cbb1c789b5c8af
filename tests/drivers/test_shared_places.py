"""Places of a Slamware robot and those kept here are the same, also after a lost link; its map is loaded with them."""

from __future__ import annotations

import asyncio
import uuid

import pytest
from chain import Drive, OpenRest, Until

from roboglot.config import SlamwareConfig
from roboglot.model.components.link import Link, LinkState
from roboglot.model.components.mapping import Mapping
from roboglot.model.components.places import Places
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.testing import Forward

pytestmark = pytest.mark.world("office")


def place(name: str, x: float = 1.0) -> PointOfInterest:
    return PointOfInterest(str(uuid.uuid5(uuid.NAMESPACE_OID, name)), Pose(x, 2.0, 0.5), {"display_name": name})


def same(one: Robot, other: Robot) -> bool:
    return {p.id: p for p in one[Places].all()} == {p.id: p for p in other[Places].all()}


async def test_what_changes_on_one_side_changes_on_the_other(
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
    # Without a link each side goes its own way; afterwards both have all of it, and of two opinions the robot's counts.
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


async def test_a_map_is_loaded_through_the_door_in_front_with_its_places(
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
    robot[Mapping].clear()
    await until(lambda: [p.metadata["display_name"] for p in robot[Places].all()] == ["elsewhere"])
    loading = asyncio.ensure_future(dashboard.set_composite_map(saved))
    await until(loading.done)
    await loading
    await until(lambda: [p.metadata["display_name"] for p in robot[Places].all()] == ["kitchen"])
    await forward(seconds=4)
    assert same(driven, robot)
    assert (robot[Mapping].grid.log_odds > 0).sum() == pytest.approx(walls, rel=0.2)
