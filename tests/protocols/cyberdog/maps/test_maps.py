"""Mapping, stored maps and their labels (6002, 6003, 6009) on a robot with all its skills."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np
import pytest

from roboglot.confirmation import confirm
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary, StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.docking import Docking
from roboglot.model.errors import Refused
from roboglot.model.events import MapReplaced
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot
from roboglot.testing import Forward
from tests.protocols.cyberdog.phone import App, Client, Stream, localized, state, until

pytestmark = pytest.mark.world("empty")
Passing = Callable[[Callable[[], object]], Awaitable[None]]


async def test_mapping_is_pushed_saved_and_read_again(
    client: Client, app: App, robot: Robot, forward: Forward, passing: Passing
) -> None:
    await forward(seconds=1)
    await client.ask(10001)
    await passing(lambda: app.connected)
    stream = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in stream.codes)
    assert await state(client) == 5
    assert await client.ask(6004, {"type": 7}) == {"accepted": 2}
    await passing(lambda: app.of(6001) and app.of(6001)[-1]["width"] > 50)
    assert app.of(6005)
    assert not app.of(6011)
    assert await client.ask(6009, {"type": 1}) == {"result": 0}  # no task of that type runs; mapping goes on
    assert not stream.ended
    assert await client.ask(6009, {"type": 5, "map_name": 7}) == {"error_code": 323}
    assert await client.ask(6009, {"type": 5, "map_name": "客厅"}) == {"result": 0}
    await until(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 0}
    assert await state(client) == 101
    stored = await robot[MapLibrary].get("客厅")
    answer = await client.ask(6003, {"mapName": "another"})
    assert (answer["mapName"], answer["success"], answer["map"]["data"]) == ("", 1, [])
    answer = await client.ask(6003, {"mapName": "客厅"})
    assert (answer["mapName"], answer["success"], answer["is_outdoor"]) == ("客厅", 0, False)
    assert answer["map"]["width"] == stored.grid.width
    assert 100 in answer["map"]["data"]
    await localized(client, passing)


@pytest.mark.parametrize("seconds", [0, 2])
async def test_a_replaced_map_is_not_saved(client, robot, forward, passing: Passing, seconds: int) -> None:
    """Another client's map is no success of this one's mapping, also before the task has noticed."""
    stream = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)
    grid = robot[Mapping].grid
    robot[Mapping].move_origin(Point(1.0, 0.0))  # still its map
    robot[Mapping].load(grid, Pose())
    await forward(seconds=seconds)
    assert await client.ask(6009, {"type": 5, "map_name": "mine"}) == {"result": 1}
    await passing(lambda: stream.ended)
    assert (stream.codes[-1], stream.answers[-1]) == (7, {"result": 3})
    assert await client.ask(6009, {"type": 5, "map_name": "mine"}) == {"result": 1}
    assert (await robot[MapLibrary].names(), robot[Mapping].grid.width > 50) == ([], True)


async def test_a_map_without_a_name_is_thrown_away(client, robot, passing: Passing) -> None:
    stream = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)
    robot[Mapping].enable(False)
    assert await client.ask(6009, {"type": 5, "map_name": ""}) == {"result": 0}
    assert robot[Mapping].grid.width == 0
    assert await robot[MapLibrary].names() == []


async def test_mapping_goes_on_if_map_cannot_be_saved(client, robot, passing: Passing, monkeypatch) -> None:
    async def full(*_: object) -> None:
        raise OSError("the disk is full")

    stream = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)
    with monkeypatch.context() as patched:
        patched.setattr(type(robot[MapLibrary]), "put", full)
        assert await client.ask(6009, {"type": 5, "map_name": "a"}) == {"result": 1}
    assert await state(client) == 5
    assert await client.ask(6009, {"type": 5, "map_name": "a"}) == {"result": 0}


@pytest.mark.world("playground")
async def test_in_map_of_earlier_life_robot_is_searched(client, door, robot, world, forward, passing: Passing) -> None:
    stream = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)
    await client.ask(6009, {"type": 5, "map_name": "old"})
    robot[Mapping].clear()  # as another door may do, or a restart
    begun = world.truth.pose_of("a")
    world.stage.place("a", Pose(2.5, 6.6, 1.0))  # and it was carried away meanwhile
    await forward(seconds=0.5)
    again = Stream(client, 6004, {"type": 7})
    await passing(lambda: again.ended)
    assert again.codes == [3100, 3101, 1000, 1001, 3103, 3104, 3108]
    assert again.answers[-1] == {"result": 0}
    assert await state(client) == 8
    assert (await client.ask(6003))["mapName"] == "old"
    believed, there = begun.compose(robot[Localization].pose), world.truth.pose_of("a")
    assert believed.distance_to(there) < 0.15


async def test_refused_map_is_not_the_one_in_use(client, robot, forward, passing: Passing, monkeypatch) -> None:
    """A real robot that refuses a map was localized in the one in memory instead."""

    async def refusal() -> Exception:
        return Refused("not now")

    def refuse(*_: object) -> None:
        confirm(asyncio.get_running_loop().create_task(refusal()))

    async def localized() -> object:
        stream = Stream(client, 6004, {"type": 7})
        await passing(lambda: stream.ended)
        return stream.answers[-1]

    await forward(seconds=2)
    await robot[MapLibrary].put(StoredMap("old", robot[Mapping].grid, 0.0))
    with monkeypatch.context() as refusing:
        refusing.setattr(robot[Mapping], "load", refuse)
        assert await localized() == {"result": 3}
    with robot.events.subscribe(MapReplaced) as replaced:
        assert await localized() == {"result": 0}
        assert replaced.drain()


@pytest.mark.slow
@pytest.mark.world("playground")
async def test_the_dock_goes_with_the_map(client, door, robot, world, forward, passing: Passing) -> None:
    stream = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)
    await client.ask(6009, {"type": 5, "map_name": "old"})
    begun = world.truth.pose_of("a")
    assert robot[DockContact].docked
    world.stage.place("a", begun.compose(Pose(1.2, 0.4, 0.6)))  # off the dock, and restarted there
    await forward(seconds=0.5)
    robot[Mapping].clear()
    robot[Docking].set_home(None)
    await localized(client, passing)
    charging = Stream(client, 6004, {"type": 9})
    await passing(lambda: charging.ended)
    assert charging.answers[-1] == {"result": 0}
    assert robot[DockContact].docked
    assert (await client.ask(10001))["charging_status"]["wireless_charging"] is True


async def test_failed_charging_is_reported_with_the_reason(client, robot, world, forward, passing: Passing) -> None:
    world.stage.place("a", Pose(6.0, 6.0, 0.0))
    await forward(seconds=0.5)
    robot[Docking].set_home(None)
    stream = Stream(client, 6004, {"type": 9})
    await passing(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 3}
    assert "no dock is known" in stream.answers[-2]["feedback_msg"]


@pytest.mark.parametrize(
    ("side", "answer"), [(1500, {"error_code": 322}), (3000, {"mapName": "big", "success": 1, "is_outdoor": False})]
)
async def test_a_map_that_fits_into_no_message(client, robot, side: int, answer: dict[str, Any]) -> None:
    grid = OccupancyGrid(np.zeros((side, side), np.int8), 0.05, Point())
    await robot[MapLibrary].put(StoredMap("big", grid, 0.0))
    got = await client.ask(6003)
    assert got.items() >= answer.items()
    assert "map" not in got or got["map"]["data"] == []


async def test_full_disk_lets_labels_and_maps_be_deleted(client, world, robot: Robot) -> None:
    labels = [{"labelName": name, "physicX": 1, "physicY": 2} for name in ("sofa", "door")]
    grid = OccupancyGrid(np.zeros((4, 4), np.int8), 0.05, Point())
    await robot[MapLibrary].put(StoredMap("home", grid, 0.0))
    assert await client.ask(6002, {"mapName": "home", "locationLabelInfo": labels}) == {"success": 0}
    await client.ask(1020, {"member": "anna"})
    world.faults.inject("full_disk", "a")
    bed = {"labelName": "bed", "physicX": 1, "physicY": 2}
    refused = await client.ask(6002, {"mapName": "home", "locationLabelInfo": [*labels, bed]})
    assert refused.get("success") != 0
    sofa = {"mapName": "home", "locationLabelInfo": [{"labelName": "sofa"}], "only_delete": True}
    assert await client.ask(6002, sofa) == {"success": 0}
    assert (await client.ask(6003, {"mapName": "home"}))["locationLabelInfo"] == labels[1:]
    assert await client.ask(6002, {"mapName": "home", "only_delete": True}) == {"success": 0}
    assert await robot[MapLibrary].names() == []
    assert await client.ask(1022, {"member": "anna"}) == {"success": True}
    assert (await client.ask(1021))["accounts"] == []


async def test_labels_are_set_replaced_and_deleted(client, robot, passing: Passing) -> None:
    stream = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)
    await client.ask(6009, {"type": 5, "map_name": "home"})

    async def labels() -> list[Any]:
        return list((await client.ask(6003))["locationLabelInfo"])

    sofa, door = (
        {"labelName": "sofa", "physicX": 1, "physicY": 2.5},
        {"labelName": "door", "physicX": 0.0, "physicY": -1},
    )
    assert await client.ask(6002, {"mapName": "home", "locationLabelInfo": [sofa, door]}) == {"success": 0}
    assert await labels() == [sofa, door]
    assert await client.ask(6002, {"mapName": "home", "locationLabelInfo": [sofa, sofa]}) == {"success": 1}
    assert await client.ask(6002, {"mapName": "away", "locationLabelInfo": [sofa]}) == {"success": 1}
    nonsense = {"mapName": "home", "locationLabelInfo": [{"labelName": 5}], "only_delete": True}
    assert await client.ask(6002, nonsense) == {"error_code": 323}  # and the map is still there:
    for wrong in ({"only_delete": "true"}, {"only_delete": 1, "locationLabelInfo": [sofa]}, {}):
        assert await client.ask(6002, {"mapName": "home", **wrong}) == {"error_code": 323}
    for misspelt in (
        {"mapName": "home", "locationLabelinfo": [sofa], "only_delete": True},
        {"mapName": "home", "locationLabelInfo": [sofa], "onlyDelete": True},
        {"map_name": "home", "map_id": 1, "locationLabelInfo": [sofa]},
    ):
        assert await client.ask(6002, misspelt) == {"error_code": 323}
    assert await labels() == [sofa, door]
    for no_list in ({}, "", 0, 0.0, False):  # each false in Python, as no labels are
        for more in ({}, {"only_delete": True}):
            assert await client.ask(6002, {"mapName": "home", "locationLabelInfo": no_list, **more}) == {
                "error_code": 323
            }
    assert await client.ask(6002, {"mapName": "home", "locationLabelInfo": [{"labelName": "bed"}]}) == {"success": 1}
    assert (await client.ask(6003, {"mapName": "home"}))["locationLabelInfo"] == [sofa, door]
    missing = {"mapName": "home", "locationLabelInfo": [{"labelName": "bed"}], "only_delete": True}
    assert await client.ask(6002, missing) == {"success": 1}
    assert await client.ask(6002, {**missing, "locationLabelInfo": [{"labelName": "sofa"}]}) == {"success": 0}
    assert await labels() == [door]
    assert await client.ask(6002, {"mapName": "home", "only_delete": True}) == {"success": 0}
    assert await robot[MapLibrary].names() == []
    for name in ("home", "", "never"):  # gone, although the robot still has it in memory
        answer = await client.ask(6003, {"mapName": name})
        assert (answer["mapName"], answer["success"]) == ("", 1)
    again = Stream(client, 6004, {"type": 7})
    await passing(lambda: again.ended)
    assert again.codes[-1] == 3102
    assert again.answers[-1] == {"result": 3}


async def test_stopping_all_tasks_while_mapping(client: Client, robot: Robot, passing: Passing) -> None:
    stream = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)
    assert await client.ask(6009, {"type": 0, "map_name": "all"}) == {"result": 0}
    await until(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 0}
    assert await robot[MapLibrary].names() == ["all"]
    assert await state(client) == 101
    assert await client.ask(6009, {"type": 0, "map_name": "another"}) == {"result": 0}  # all is stopped; none is saved
    assert await robot[MapLibrary].names() == ["all"]


async def test_map_cleared_while_it_is_saved_is_loaded(client, robot, passing: Passing, monkeypatch) -> None:
    stream, put = Stream(client, 6004, {"type": 5}), robot[MapLibrary].put
    await passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)

    async def put_slowly(stored: StoredMap) -> None:
        robot[Mapping].clear()  # by another client
        await put(stored)

    monkeypatch.setattr(robot[MapLibrary], "put", put_slowly)
    assert await client.ask(6009, {"type": 5, "map_name": "home"}) == {"result": 0}
    await until(lambda: stream.ended)
    await localized(client, passing)


async def test_misspelt_name_discards_no_map(client: Client, robot: Robot, passing: Passing) -> None:
    stream = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in stream.codes and robot[Mapping].grid.width > 50)
    assert await client.ask(6009, {"type": 5, "mapName": "home"}) == {"error_code": 323}
    assert await state(client) == 5
    assert await client.ask(6009, {"type": 1, "mapName": "home"}) == {"result": 0}  # stopping needs no name
    assert await client.ask(6009, {"type": 5, "map_name": "home", "mapName": "x"}) == {"result": 0}
    assert await robot[MapLibrary].names() == ["home"]


async def test_map_is_found_by_its_app_s_number(client: Client, robot: Robot) -> None:
    grid = OccupancyGrid(np.ones((4, 4), np.int8), 0.05, Point())
    for name in ("attic", "cellar"):
        await robot[MapLibrary].put(StoredMap(name, grid, 0.0))
    bed = {"labelName": "bed", "physicX": 0.1, "physicY": 0.1}
    numbered = {"mapName": "attic", "map_id": 2**63 + 5, "locationLabelInfo": [bed]}
    assert await client.ask(6002, numbered) == {"success": 0}
    assert (await client.ask(6003, {"map_id": 2**63 + 5}))["mapName"] == "attic"
    assert (await client.ask(6003, {"map_id": 77}))["mapName"] == "cellar"  # an unknown number counts as none
    assert (await client.ask(6003, {"mapName": "attic"}))["locationLabelInfo"] == [bed]
    assert await client.ask(6002, {**numbered, "mapName": "cellar"}) == {"success": 0}  # it means one map at a time
    assert (await client.ask(6003, {"map_id": 2**63 + 5}))["mapName"] == "cellar"
    for no_name in (7, ["attic"], {}, False):  # taken as absent, it would mean the map of that number
        wrong = {"mapName": no_name, "map_id": 2**63 + 5, "only_delete": True}
        assert await client.ask(6002, wrong) == {"error_code": 323}
    assert await client.ask(6002, {"map_id": 2**63 + 5, "only_delete": True}) == {"success": 0}
    assert await robot[MapLibrary].names() == ["attic"]
    for number in (-1, 2**64):
        assert await client.ask(6003, {"map_id": number}) == {"error_code": 323}
        assert await client.ask(6002, {"mapName": "attic", "map_id": number}) == {"error_code": 323}
