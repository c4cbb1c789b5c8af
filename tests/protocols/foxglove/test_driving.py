"""Panels drive the robot: teleoperation, goals, poses and parameters, under control and rights."""

from __future__ import annotations

import math
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus

from roboglot.model.admission import Admission
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.lease import Lease
from roboglot.model.errors import Forbidden
from roboglot.operations import Right
from tests.protocols.foxglove.conftest import ADDRESS, PORT, Scene, Viewer
from tests.protocols.held_fairness import held

FORWARD = {"linear": {"x": 0.3, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}}


def stamped(x: float, y: float, yaw: float = 0.0, frame: str = "a/map") -> dict[str, Any]:
    orientation = {"x": 0, "y": 0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
    return {"header": {"frame_id": frame}, "pose": {"position": {"x": x, "y": y, "z": 0}, "orientation": orientation}}


async def publisher(scene: Scene, topic: str, schema: str = "geometry_msgs/Twist") -> Viewer:
    viewer = await scene.connect()
    await viewer.advertise(topic, schema)
    return viewer


@pytest.mark.parametrize("topic", ["/cmd_vel", "/a/cmd_vel"])
async def test_teleoperation_drives_until_the_dead_mans_time(scene: Scene, topic: str) -> None:
    viewer = await publisher(scene, topic)
    await viewer.publish(FORWARD)
    await viewer.settled()
    await scene.clock.advance(4.0)
    x = scene.robot[Odometry].reading.pose.x
    assert 0.3 < x < 0.6  # 1.5 s at 0.3 m/s, then it brakes
    await scene.clock.advance(1.0)
    assert scene.robot[Odometry].reading.pose.x == pytest.approx(x, abs=0.01)


async def test_stop_waits_for_no_other_client(scene: Scene) -> None:
    viewer, fairness = await publisher(scene, "/cmd_vel"), held(scene.robot)
    await viewer.settled()
    fairness.on, counted = True, len(fairness.counted)
    await viewer.publish(FORWARD)
    await viewer.until(lambda: fairness.waited)
    assert not scene.robot.actions.running()
    await viewer.publish(FORWARD | {"linear": {"x": 0, "y": -0.0, "z": 0}})
    await viewer.until(lambda: len(fairness.counted) >= counted + 2)
    await scene.clock.advance(1.0)
    assert scene.robot[Odometry].reading.pose.x == pytest.approx(0.0, abs=0.01)
    waited = len(fairness.waited)
    await viewer.publish(FORWARD)
    await viewer.until(lambda: len(fairness.waited) > waited + 3)
    fairness.on = False
    await viewer.settled()
    await scene.clock.advance(1.0)
    assert scene.robot[Odometry].reading.pose.x > 0.1


async def test_drive_ends_when_its_viewer_leaves(scene: Scene) -> None:
    viewer = await publisher(scene, "/goal_pose", "geometry_msgs/PoseStamped")
    await viewer.publish(stamped(3.0, 0.0))
    await viewer.settled()
    await scene.clock.advance(1.0)
    assert scene.robot.actions.running()
    await viewer.close()
    await viewer.until(lambda: not scene.robot.actions.running(), 5.0)


async def test_goal_of_one_that_left_is_dropped(scene: Scene) -> None:
    viewer, fairness = await publisher(scene, "/goal_pose", "geometry_msgs/PoseStamped"), held(scene.robot)
    await viewer.settled()
    fairness.on, counted = True, len(fairness.counted)
    await viewer.publish(stamped(3.0, 0.0))
    await viewer.until(lambda: fairness.waited)
    await viewer.close()
    fairness.on = False
    await viewer.until(lambda: len(fairness.counted) > counted)
    assert not scene.robot.actions.running()


async def test_a_goal_is_reached(scene: Scene) -> None:
    viewer = await publisher(scene, "/move_base_simple/goal", "geometry_msgs/PoseStamped")
    await viewer.publish(stamped(0.8, 0.0, math.pi / 2, frame="a/base_link"))
    await viewer.settled()
    assert scene.robot.actions.running()
    await viewer.until(lambda: not scene.robot.actions.running(), 60.0)
    pose = scene.robot[Localization].pose
    assert (pose.x, pose.y) == pytest.approx((0.8, 0.0), abs=0.1)
    assert pose.yaw == pytest.approx(math.pi / 2, abs=0.1)
    assert viewer.complaints == []


async def test_a_goal_that_fails_is_reported(scene: Scene) -> None:
    viewer = await publisher(scene, "/goal_pose", "geometry_msgs/PoseStamped")
    await viewer.publish(stamped(500.0, 500.0))
    await viewer.until(lambda: viewer.complaints, 120.0)


async def test_the_pose_is_set(scene: Scene) -> None:
    viewer = await publisher(scene, "/initialpose", "geometry_msgs/PoseWithCovarianceStamped")
    place = stamped(1.0, 2.0, 0.5)
    await viewer.publish({"header": place["header"], "pose": {"pose": place["pose"], "covariance": [0] * 36}})
    await viewer.settled()
    assert viewer.complaints == []
    pose = scene.robot[Localization].pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((1.0, 2.0, 0.5), abs=0.01)


@pytest.mark.parametrize("length", [1e200, 3.0, 1e-300])
async def test_a_quaternion_of_any_length_turns(scene: Scene, length: float) -> None:
    viewer = await publisher(scene, "/initialpose", "geometry_msgs/PoseWithCovarianceStamped")
    turn = {"x": 0, "y": 0, "z": length * math.sin(0.5), "w": length * math.cos(0.5)}
    for orientation, yaw in ((turn, 1.0), ({"x": 0, "y": length, "z": 0, "w": 0}, math.pi)):
        await viewer.publish({"pose": {"pose": {"position": {"x": 1}, "orientation": orientation}}})
        await viewer.settled()
        assert viewer.complaints == []
        assert math.cos(scene.robot[Localization].pose.yaw - yaw) > 0.99


async def test_invalid_messages_are_refused(scene: Scene) -> None:
    viewer = await publisher(scene, "/cmd_vel")
    await viewer.advertise("/fly", "geometry_msgs/Twist", 2)
    await viewer.advertise("/a/goal_pose", "geometry_msgs/PoseStamped", 3, encoding="cdr")
    await viewer.advertise("/a/goal_pose", "geometry_msgs/PoseStamped", 1)
    await viewer.publish(FORWARD, number=9)
    await viewer.publish(b"{")
    await viewer.publish(b'{"linear": 3}')
    await viewer.publish(b'{"linear": {"x": 1e300}, "angular": {}}')
    await viewer.advertise("/a/goal_pose", "geometry_msgs/PoseStamped", 4)
    await viewer.publish(stamped(1, 1, frame="moon"), number=4)
    await viewer.publish({"pose": {"orientation": {"w": 0}}}, number=4)
    await viewer.publish(b'{"header": {"frame_id": "\xff"}}', number=4)
    await viewer.settled()
    assert len(viewer.complaints) == 10, viewer.complaints
    assert viewer.complaints[-1] == "messageData: /a/goal_pose: the text is not UTF-8"
    assert not scene.robot.actions.running()


async def test_control_that_another_took_is_respected(scene: Scene) -> None:
    await scene.robot[Lease].take()
    viewer = await publisher(scene, "/cmd_vel")
    await viewer.publish(FORWARD)
    await viewer.settled()
    assert viewer.complaints == ["messageData: control is taken by a person"]
    await scene.robot[Lease].release()
    await viewer.publish(FORWARD)
    await viewer.settled()
    assert scene.robot[Lease].holder.who.startswith("foxglove 127.")


class Visitors(Admission):
    """Lets all see and nothing else."""

    enforced = True
    connections_max = 10

    def check(self, door: str, operation: str, right: Right | None) -> None:  # noqa: ARG002
        if right is not Right.SEE:
            raise Forbidden(f"{operation} needs {right}")


async def test_viewer_with_right_to_see_cannot_drive(scene: Scene) -> None:
    scene.robot.admission = Visitors()
    viewer = await publisher(scene, "/cmd_vel")
    await viewer.publish(FORWARD)
    await viewer.say("setParameters", parameters=[{"name": "speaker.volume", "value": 0.1}])
    await viewer.settled()
    assert [words.partition(":")[0] for words in viewer.complaints] == ["advertise", "messageData", "setParameters"]
    assert not scene.robot.actions.running()


async def test_parameters_are_read_set_and_followed(scene: Scene) -> None:
    viewer, other = await scene.connect(), await scene.connect()
    await viewer.say("getParameters", parameterNames=[], id="all")
    await viewer.until(lambda: "parameterValues" in viewer.said)
    values = {row["name"]: row["value"] for row in viewer.said["parameterValues"][0]["parameters"]}
    assert values["robot.name"] == "a"
    assert values["localization.enabled"] is True
    await other.say("subscribeParameterUpdates", parameterNames=["speaker.volume"])
    await other.settled()
    await viewer.say("setParameters", parameters=[{"name": "speaker.volume", "value": 0.25}], id="set")
    await viewer.until(lambda: any(row.get("id") == "set" for row in viewer.said["parameterValues"]))
    assert viewer.said["parameterValues"][-1]["parameters"] == [
        {"name": "speaker.volume", "value": 0.25, "type": "float64"}
    ]
    assert scene.robot[Speaker].volume == 0.25
    await other.topic("/a/pose")
    await other.until(lambda: len(other.said["parameterValues"]) > 1, 2.0)
    assert other.said["parameterValues"][-1]["parameters"][0]["value"] == 0.25


async def test_parameters_are_followed_as_parts_appear(scene: Scene) -> None:
    """A real robot's parts are known once it is connected."""
    viewer, speaker = await scene.connect(), scene.robot[Speaker]
    scene.robot.withdraw(Speaker)
    await viewer.say("subscribeParameterUpdates", parameterNames=[])
    await viewer.settled()

    def volumes() -> list[Any]:
        rows = [row for said in viewer.said["parameterValues"] for row in said["parameters"]]
        return [row.get("value") for row in rows if row["name"] == "speaker.volume"]

    scene.robot.add(Speaker, speaker)
    await viewer.until(volumes, 2.0)
    scene.robot.withdraw(Speaker)
    await viewer.until(lambda: len(volumes()) == 2, 2.0)
    assert volumes() == [speaker.volume, None]


async def test_parameters_that_cannot_be_are_refused(scene: Scene) -> None:
    viewer = await scene.connect()
    for name, value in (("no.such", 1), ("robot.name", "b"), ("speaker.volume", "loud"), ("speaker.volume", 7)):
        await viewer.say("setParameters", parameters=[{"name": name, "value": value}])
    await viewer.settled()
    assert len(viewer.complaints) == 4
    assert "there is no parameter 'no.such'" in viewer.complaints[0]


async def test_parameters_are_set_without_being_followed(scene: Scene) -> None:
    viewer = await scene.connect()
    await viewer.say("setParameters", parameters=[{"name": "speaker.volume", "value": 0.5}])
    await viewer.settled()
    assert viewer.complaints == []
    assert scene.robot[Speaker].volume == 0.5


async def test_pages_of_other_hosts_stay_outside(scene: Scene) -> None:
    for page in ("https://app.foxglove.dev", "http://evil.example", "null"):
        with pytest.raises(InvalidStatus) as refused:
            await scene.connect(origin=page)
        assert refused.value.response.status_code == 403
    assert await scene.connect(origin=f"http://{ADDRESS}:{PORT}")


async def test_robot_that_goes_down_takes_no_goal(scene: Scene) -> None:
    viewer = await publisher(scene, "/cmd_vel")
    scene.robot.starts.down = "the robot restarts"
    await viewer.publish(FORWARD)
    await viewer.until(lambda: any("the robot restarts" in why for why in viewer.complaints))
    assert not scene.robot.actions.running()
