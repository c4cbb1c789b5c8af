"""Maps made outdoors: their kind, their place on the globe, their own words for the state of a task."""

from __future__ import annotations

from dataclasses import replace

import pytest

from roboglot.model.components.mapping.localization import Localization, Region
from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.sensing.gps import Gps, GpsFix
from roboglot.model.geometry import Pose
from tests.protocols.cyberdog.phone import Client, Stream, state, until

pytestmark = pytest.mark.world("yard", body="cyberdog2")


async def made(client: Client, robot, forward, passing, name: str) -> None:
    """An outdoor map under that name, made while satellites were seen."""
    await forward(seconds=45)  # the receiver first searches for satellites, then is coarse for as long
    stream = Stream(client, 6004, {"type": 5, "outdoor": True})
    await passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)
    assert await state(client) == 15
    assert await client.ask(6009, {"type": 5, "map_name": name}) == {"result": 0}
    await until(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 0}


@pytest.mark.slow
async def test_from_the_map_to_the_goal(client: Client, robot, world, forward, passing, monkeypatch) -> None:
    world.stage.place("a", Pose(16.0, 10.0, 1.0))
    await made(client, robot, forward, passing, "yard")
    kept = await robot[MapLibrary].get("yard")
    assert kept.outdoor
    assert kept.anchor
    assert (await client.ask(6003))["is_outdoor"] is True
    assert await client.ask(6004, {"type": 1, "goalX": 1.0, "goalY": 0.0, "outdoor": True}) == {"accepted": 2}

    indoors = Stream(client, 6004, {"type": 7})  # the map is of the other kind
    await passing(lambda: indoors.ended)
    assert indoors.codes == [3100, 3102]
    assert indoors.answers[-1] == {"result": 3}
    assert await state(client) == 6

    robot[Mapping].clear()  # as a restart does: localization has to search where the satellites say
    asked: list[Region | None] = []
    relocalize = robot[Localization].relocalize

    def relocalize_as_seen(region: Region | None = None, **more: object) -> object:
        asked.append(region)
        return relocalize(region, **more)

    monkeypatch.setattr(robot[Localization], "relocalize", relocalize_as_seen)
    assert robot[Gps].reading.fix is not GpsFix.NONE
    stream = Stream(client, 6004, {"type": 7, "outdoor": True})
    await passing(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 0}
    assert await state(client) == 18
    (region,) = asked
    assert region
    assert region.min_x < robot[Localization].pose.x < region.max_x
    assert region.max_x - region.min_x < 20.0

    assert await client.ask(6004, {"type": 1, "goalX": 1.0, "goalY": 0.0}) == {"accepted": 2}  # not localized indoors
    before = world.truth.pose_of("a")
    going = Stream(client, 6004, {"type": 1, "goalX": 1.0, "goalY": 0.0, "outdoor": True})
    await passing(lambda: 307 in going.codes)
    assert await state(client) == 21
    await passing(lambda: going.ended)
    assert going.answers[-1] == {"result": 0}
    assert world.truth.pose_of("a").distance_to(before) > 0.7
    assert await state(client) == 18
    assert await client.ask(6009, {"type": 0}) == {"result": 0}
    assert await state(client) == 101


@pytest.mark.slow
async def test_satellites_that_see_the_robot_elsewhere_confirm_nothing(
    client: Client, robot, world, forward, passing, monkeypatch
) -> None:
    """The lidar alone would find it: the map is the same; but it is a yard elsewhere."""
    world.stage.place("a", Pose(16.0, 10.0, 1.0))
    await made(client, robot, forward, passing, "yard")
    robot[Mapping].clear()
    reading = robot[Gps].reading
    monkeypatch.setattr(
        type(robot[Gps]), "reading", property(lambda _: replace(reading, latitude=reading.latitude + 0.01))
    )
    stream = Stream(client, 6004, {"type": 7, "outdoor": True})
    await passing(lambda: 3107 in stream.codes)
    await client.ask(6009, {"type": 7})
    await until(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 5}
    assert 3108 not in stream.codes


@pytest.mark.world("playground")
async def test_carried_robot_is_not_placed_where_it_was(client: Client, robot, world, forward, passing) -> None:
    await forward(seconds=2)
    begun = world.truth.pose_of("a").compose(robot[Localization].pose.inverse())
    assert robot[Localization].quality > 0.5
    world.stage.place("a", Pose(2.5, 6.6, 1.0))
    await forward(seconds=0.1)  # its own estimate is still good
    assert robot[Localization].quality > 0.5
    stream = Stream(client, 6004, {"type": 7})
    await passing(lambda: stream.ended or 3107 in stream.codes)
    believed = begun.compose(robot[Localization].pose)
    assert 3108 not in stream.codes or believed.distance_to(world.truth.pose_of("a")) < 0.2


async def test_outdoors_without_a_map_nothing_is_found(client, robot, forward, passing) -> None:
    await forward(seconds=1)
    stream = Stream(client, 6004, {"type": 7, "outdoor": True})
    await passing(lambda: stream.ended)
    assert stream.codes == [3100, 3102]
    assert await state(client) == 16
