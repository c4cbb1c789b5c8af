"""The layout that ships shows and drives what the door has."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from roboglot.protocols.foxglove.chapters.publishing import TOPICS
from tests.protocols.foxglove.conftest import Scene

LAYOUT = Path(__file__).parents[3] / "examples" / "foxglove" / "layout.json"


def panels(node: Any) -> set[str]:
    return {node} if isinstance(node, str) else panels(node["first"]) | panels(node["second"])


async def test_its_topics_are_there(scene: Scene) -> None:
    layout = json.loads(LAYOUT.read_text(encoding="utf-8"))
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
    topic = json.loads(LAYOUT.read_text(encoding="utf-8"))["configById"]["Image!camera"]["imageMode"]["imageTopic"]
    viewer = await scene.connect()
    number = await viewer.subscribe(topic)
    assert viewer.channels[topic]["schemaName"] == "foxglove.CompressedVideo"
    await viewer.until(lambda: viewer.data.get(number), 5.0)
    await viewer.say("unsubscribe", subscriptionIds=[number])
    await viewer.settled()
    count = len(viewer.data[number])
    await scene.clock.advance(1.0)
    await viewer.settled()
    assert len(viewer.data[number]) <= count + 2  # what was on its way
