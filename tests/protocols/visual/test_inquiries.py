"""Inquiries for modules, people and maps."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

import numpy as np
from front_end import FrontEnd

from roboglot.model.components.map_library import Label, MapLibrary, StoredMap
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot

Connect = Callable[..., Coroutine[Any, Any, FrontEnd]]


async def test_modules_people_and_maps_say_what_is_not_there(app: FrontEnd) -> None:
    assert (await app.ask("inquiry", type="module"))[0]["list"] == []
    assert (await app.ask("delete", "m", type="module"))[0]["state"] == 27
    fields = {"mode": "common", "condition": "f()", "body": "pass"}
    assert (await app.ask("save", "m", type="module", **fields))[0]["state"] == 29
    assert (await app.ask("inquiry", type="AI", mode="face"))[0]["state"] == 29
    assert (await app.ask("inquiry", type="SLAM", mode="map"))[0]["state"] == 29  # this robot keeps no maps


async def test_the_maps_of_a_robot_that_keeps_some(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    for mode in ("map", "preset"):
        assert (await app.ask("inquiry", type="SLAM", mode=mode))[0]["list"] == []
    grid = OccupancyGrid(np.zeros((2, 2), np.int8), 0.05, Point())
    for name, labels in (("old", ()), ("home", (Label("厨房", Point(1.5, -2)), Label("desk", Point(0, 3))))):
        await robot[MapLibrary].put(StoredMap(name, grid, 0.0, labels))
    [maps] = await app.ask("inquiry", type="SLAM", mode="map")
    assert [item["id"] for item in maps["list"]] == ["home", "old"]
    [presets] = await app.ask("inquiry", type="SLAM", mode="preset")
    assert [item["id"] for item in presets["list"]] == ["desk", "厨房"]
    assert presets["list"][1] == {
        "id": "厨房",
        "mode": "preset",
        "style": "[1.500000, -2.000000, 0.000000]",
        "condition": "home",
        "describe": "厨房",
    }
    [one] = await app.ask("inquiry", "厨房", type="SLAM", mode="preset")
    assert [item["id"] for item in one["list"]] == ["厨房"]
