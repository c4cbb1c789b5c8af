"""Inquiries for modules, people and maps."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

import numpy as np

from roboglot.model.components.interaction.members import Members
from roboglot.model.components.interaction.training_words import TrainedWord, TrainingWords
from roboglot.model.components.mapping.map_library import Label, MapLibrary, StoredMap
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot
from tests.protocols.visual.front_end import FrontEnd

Connect = Callable[..., Coroutine[Any, Any, FrontEnd]]


async def test_modules_people_and_maps_report_what_is_missing(app: FrontEnd) -> None:
    assert (await app.ask("inquiry", type="module"))[0]["list"] == []
    assert (await app.ask("delete", "m", type="module"))[0]["state"] == 27
    assert (await app.ask("inquiry", type="AI", mode="face"))[0]["state"] == 29  # this robot keeps no members
    assert (await app.ask("inquiry", type="SLAM", mode="map"))[0]["state"] == 29  # this robot keeps no maps


async def test_people_and_training_words(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)

    async def ids(mode: str, *targets: str) -> list[str]:
        return [item["id"] for item in (await app.ask("inquiry", *targets, type="AI", mode=mode))[0]["list"]]

    members = robot[Members]
    for name in ("张三", "Ann"):
        await members.add(name)
    zhang, ann = str(members.get("张三").id), str(members.get("Ann").id)
    await members.set_face("Ann", b"face")
    await members.set_voice("张三", b"voice")
    [answer] = await app.ask("inquiry", type="AI", mode="personnel")
    assert answer["list"] == [
        {"id": zhang, "mode": "personnel", "style": "0", "condition": "1", "describe": "张三"},
        {"id": ann, "mode": "personnel", "style": "1", "condition": "0", "describe": "Ann"},
    ]
    assert (await ids("face"), await ids("voiceprint")) == ([ann], [zhang])
    [answer] = await app.ask("inquiry", "终止任务", type="AI", mode="training_words")
    word = {"id": "终止任务", "mode": "training_words", "style": "vp_task", "condition": "shutdown"}
    assert answer["list"] == [word | {"describe": "终止任务"}]
    assert await ids("all") == [zhang, ann, *sorted(["终止任务", "暂停任务", "继续任务"])]
    assert await ids("all", ann, "unknown") == [ann]
    await robot[TrainingWords].learn(TrainedWord("跳舞", "dance"))
    [answer] = await app.ask("inquiry", "跳舞", type="AI", mode="training_words")
    assert answer["list"][0]["condition"] == "dance"


async def test_the_maps_of_a_robot_that_keeps_some(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    for mode in ("map", "preset"):
        assert (await app.ask("inquiry", type="SLAM", mode=mode))[0]["list"] == []
    grid = OccupancyGrid(np.zeros((2, 2), np.int8), 0.05, Point())
    for name, labels in (("old", ()), ("home", (Label("厨房", Point(1.5, -2)), Label("desk", Point(0, 3))))):
        await robot[MapLibrary].put(StoredMap(name, grid, 0.0, labels, outdoor=name == "old"))
    [maps] = await app.ask("inquiry", type="SLAM", mode="map")
    assert [(item["id"], item["condition"]) for item in maps["list"]] == [("home", "indoor"), ("old", "outdoor")]
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
