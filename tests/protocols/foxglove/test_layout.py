"""The layouts that ship show and drive what the door has, in panels that each app has."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from roboglot.protocols.foxglove.chapters.publishing import TOPICS
from tests.protocols.foxglove.conftest import Scene

FOLDER = Path(__file__).parents[3] / "examples" / "foxglove"
LAYOUT, LICHTBLICK = FOLDER / "layout.json", FOLDER / "lichtblick.json"
TEXTS = {path: path.read_text(encoding="utf-8") for path in (LAYOUT, LICHTBLICK)}
PANELS = {"3D", "Image", "Teleop", "Plot", "RawMessages"}  # of both apps; Lichtblick's list has no Parameters


def panels(node: Any) -> set[str]:
    return {node} if isinstance(node, str) else panels(node["first"]) | panels(node["second"])


@pytest.mark.parametrize(("file", "more"), [(LAYOUT, {"Parameters"}), (LICHTBLICK, set())])
def test_each_app_knows_the_panels(file: Path, more: set[str]) -> None:
    configs = json.loads(TEXTS[file])["configById"]
    assert {name.partition("!")[0] for name in configs} == PANELS | more


@pytest.mark.parametrize("file", [LAYOUT, LICHTBLICK])
async def test_its_topics_are_there(scene: Scene, file: Path) -> None:
    layout = json.loads(TEXTS[file])
    assert set(layout) == {"configById", "layout", "globalVariables", "userNodes", "playbackConfig"}
    configs = layout["configById"]
    assert panels(layout["layout"]) == set(configs)
    three = configs["3D!robot"]
    shown = {
        *three["topics"],
        configs["Plot!battery"]["paths"][0]["value"].partition(".")[0],
        configs["RawMessages!actions"]["topicPath"],
        configs["RawMessages!wire"]["topicPath"],
    }
    viewer = await scene.connect()
    await viewer.advertise("/a/cmd_vel", "geometry_msgs/Twist")
    drive = {"linear": {"x": 0.1, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}}
    await viewer.publish(drive)
    await scene.get("/api/core/system/v1/power/status")
    await viewer.until(lambda: shown <= set(viewer.channels), 6.0)
    published = [three["publish"]["poseTopic"], three["publish"]["poseEstimateTopic"], configs["Teleop!drive"]["topic"]]
    assert all(topic.removeprefix("/a/") in TOPICS for topic in published)


async def test_camera_is_there_and_films_only_for_viewers(scene: Scene) -> None:
    topic = json.loads(TEXTS[LAYOUT])["configById"]["Image!camera"]["imageMode"]["imageTopic"]
    viewer = await scene.connect()
    number = await viewer.subscribe(topic)
    assert viewer.channels[topic]["schemaName"] == "foxglove.CompressedVideo"
    await viewer.until(lambda: viewer.data.get(number), 5.0)
    await viewer.say("unsubscribe", subscriptionIds=[number])
    await viewer.settled()
    count = len(viewer.data[number])
    await scene.clock.advance(1.0)
    await viewer.settled()
    assert len(viewer.data[number]) <= count + 2  # messages already on the way
