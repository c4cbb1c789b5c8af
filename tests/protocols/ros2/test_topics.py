"""A peer that knows rmw_zenoh's form alone sees the robot's topics and drives it."""

from __future__ import annotations

import asyncio
import math
from typing import Any

import numpy as np
import pytest

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.sensing.camera import Camera, Frame
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.lease import Lease
from roboglot.model.errors import Unconnected
from roboglot.protocols.ros2.dispatch import MESSAGE_MAX
from roboglot.protocols.ros2.server import PASSED_MAX, PENDING_MAX
from tests.protocols.held_fairness import held
from tests.protocols.ros2.conftest import STORE, Opened, Peer, Scene

TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/PoseStamped"
WITH_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"
LOG = "rcl_interfaces/msg/Log"


def made(type: str, **fields: Any) -> Any:
    return STORE.types[type](**fields)


def vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
    return made("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def header(frame: str) -> Any:
    return made("std_msgs/msg/Header", stamp=made("builtin_interfaces/msg/Time", sec=0, nanosec=0), frame_id=frame)


def pose(x: float, y: float, yaw: float = 0.0) -> Any:
    turn = made("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    return made("geometry_msgs/msg/Pose", position=made("geometry_msgs/msg/Point", x=x, y=y, z=0.0), orientation=turn)


STILL = made(TWIST, linear=vector(-0.0), angular=vector())
FORWARD = made(TWIST, linear=vector(0.3), angular=vector())


async def published(scene: Scene, topic: str, type: str, message: Any) -> None:
    """Publish, and return when the robot has heard it."""
    heard: list[Any] = []
    leave = scene.robot.tap.listen(heard.append)
    scene.peer.publish(topic, type, message)
    await scene.peer.until(lambda: len(heard) >= 2)
    leave()


async def test_stop_waits_for_no_other_client(opened: Opened) -> None:
    scene = await opened()
    fairness, heard = held(scene.robot), list[Any]()
    leave = scene.robot.tap.listen(heard.append)
    fairness.on = True
    for _ in range(3 * PENDING_MAX):  # more than are kept: the oldest go
        scene.peer.publish("/a/cmd_vel", TWIST, FORWARD)
    await scene.peer.until(lambda: fairness.waited)
    scene.peer.publish("/a/cmd_vel", TWIST, STILL)
    stop = bytes(STORE.serialize_cdr(STILL, TWIST))
    await scene.peer.until(lambda: any(exchange.payload == stop for exchange in heard))
    leave()
    await scene.peer.until(lambda: not scene.robot.actions.running(), 5.0)
    waited = len(fairness.waited)
    scene.peer.publish("/a/cmd_vel", TWIST, FORWARD)
    await scene.peer.until(lambda: len(fairness.waited) > waited + 3)
    assert not scene.robot.actions.running()
    fairness.on = False
    await scene.peer.until(scene.robot.actions.running)
    assert set(fairness.counted) == {"ros2 a:zenoh"}


@pytest.mark.slow
async def test_topics_come_with_the_robots_values(opened: Opened) -> None:
    scene = await opened()
    peer = scene.peer
    kinds = {
        "/a/scan": "sensor_msgs/msg/LaserScan",
        "/a/odom": "nav_msgs/msg/Odometry",
        "/tf": "tf2_msgs/msg/TFMessage",
        "/a/pose": STAMPED,
        "/a/joint_states": "sensor_msgs/msg/JointState",
        "/a/image/compressed": "sensor_msgs/msg/CompressedImage",
    }
    for topic, type in kinds.items():
        peer.listen(topic, type)
    kept = {
        "/a/map": "nav_msgs/msg/OccupancyGrid",
        "/tf_static": "tf2_msgs/msg/TFMessage",
    }
    await peer.until(lambda: all(peer.heard[topic] for topic in kinds), 8.0)
    for topic, type in kept.items():  # a latecomer
        peer.listen(topic, type, history=True)
    await peer.until(lambda: all(peer.heard[topic] for topic in kept), 7.0)
    scan = peer.heard["/a/scan"][-1]
    assert scan.header.frame_id == "a/laser"
    assert len(scan.ranges) > 100
    assert scan.range_max == 12.0
    pairs = {(t.header.frame_id, t.child_frame_id) for message in peer.heard["/tf"] for t in message.transforms}
    assert pairs == {("a/map", "a/odom"), ("a/odom", "a/base_link")}
    grid = peer.heard["/a/map"][-1]
    assert grid.info.resolution == pytest.approx(0.05, abs=0.03)
    assert len(grid.data) == grid.info.width * grid.info.height > 0
    picture = peer.heard["/a/image/compressed"][-1]
    assert (picture.format, bytes(picture.data[:2])) == ("jpeg", b"\xff\xd8")
    assert peer.heard["/a/joint_states"][-1].name == ["gimbal_pitch", "gimbal_yaw"]


async def test_pictures_go_on_after_a_lost_one(opened: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first picture that a real robot did not send ended the topic for good."""
    scene = await opened()
    camera, topic, captures = scene.robot[Camera], "/a/image/compressed", list[float]()
    capture = camera.capture

    async def silent_once() -> Frame:
        captures.append(scene.robot.clock.time())
        if len(captures) == 1:
            raise Unconnected("the robot sends no pictures")
        return await capture()

    monkeypatch.setattr(camera, "capture", silent_once)
    scene.peer.listen(topic, "sensor_msgs/msg/CompressedImage")
    await scene.peer.until(lambda: scene.peer.heard[topic], 5)
    assert len(captures) > 1


async def test_pictures_come_once_there_is_a_camera(opened: Opened) -> None:
    """A real robot's camera is known once it is connected."""
    scene = await opened()
    camera, topic = scene.robot[Camera], "/a/image/compressed"
    scene.robot.withdraw(Camera)
    scene.peer.listen(topic, "sensor_msgs/msg/CompressedImage")
    await scene.peer.clock.advance(1.0)
    scene.robot.add(Camera, camera)
    await scene.peer.until(lambda: scene.peer.heard[topic], 8.0)


async def test_each_publisher_numbers_its_own_messages(opened: Opened) -> None:
    """Nodes of rmw_zenoh report gaps in them as lost messages."""
    scene = await opened()
    peer, senders = scene.peer, set[bytes]()
    for topic, type in (("/a/odom", "nav_msgs/msg/Odometry"), ("/a/pose", STAMPED)):
        peer.listen(topic, type)
    await peer.until(lambda: all(len(attached) > 4 for attached in peer.attachments.values()), 5.0)
    for attached in peer.attachments.values():
        numbers = [number for number, *_ in attached]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        assert {length for _, _, length, _ in attached} == {16}
        (sender,) = {gid for *_, gid in attached}
        senders.add(sender)
    assert len(senders) == 2


async def test_longest_message_is_dropped_by_the_router(opened: Opened) -> None:
    scene = await opened()
    scene.peer.listen("/rosout", LOG)
    for size in (PASSED_MAX + 100_000, MESSAGE_MAX + 1, 1):
        await asyncio.to_thread(scene.peer.publish, "/a/goal_pose", STAMPED, bytes(size))
    await scene.peer.until(lambda: len(scene.peer.heard["/rosout"]) == 2)
    assert ["at most" in line.msg for line in scene.peer.heard["/rosout"]] == [True, False]


async def test_the_battery_is_there_for_who_comes_late(opened: Opened) -> None:
    scene = await opened()
    scene.peer.listen("/a/battery_state", "sensor_msgs/msg/BatteryState", history=True)
    await scene.peer.until(lambda: scene.peer.heard["/a/battery_state"], 5.0)
    assert 0.0 < scene.peer.heard["/a/battery_state"][-1].percentage <= 1.0


async def test_pressure_is_published_each_second(opened: Opened) -> None:
    scene = await opened()
    scene.peer.listen("/a/pressure", "sensor_msgs/msg/FluidPressure")
    await scene.peer.until(lambda: len(scene.peer.heard["/a/pressure"]) > 1, 5.0)
    message = scene.peer.heard["/a/pressure"][-1]
    assert 80_000 < message.fluid_pressure < 110_000
    assert (message.variance, message.header.frame_id) == (4.0, "a/base_link")


async def test_the_graph_shows_a_node_with_its_ends(opened: Opened) -> None:
    scene = await opened()
    await scene.peer.clock.advance(1.0)
    tokens = await asyncio.to_thread(scene.peer.graph)
    nodes = [token for token in tokens if token[5] == "NN"]
    assert [token[6:] for token in nodes] == [["%", "%a", "roboglot"]]
    ends = {(token[5], token[9]): token for token in tokens if token[5] != "NN"}
    assert {("MS", "%a%cmd_vel"), ("MS", "%a%goal_pose"), ("MS", "%a%initialpose"), ("MP", "%tf")} <= set(ends)
    assert ends["MS", "%a%cmd_vel"][10:12] == ["geometry_msgs::msg::dds_::Twist_", STORE.hash_rihs01(TWIST)]
    assert len({token[4] for token in tokens}) == len(tokens)


async def test_cmd_vel_drives_until_the_dead_mans_time(opened: Opened) -> None:
    scene = await opened()
    await published(scene, "/a/cmd_vel", TWIST, FORWARD)
    await scene.peer.clock.advance(3.0)
    assert 0.05 < scene.robot[Odometry].reading.pose.x < 0.25  # half a second at 0.3 m/s, then it brakes


async def test_goal_is_reached_and_the_pose_is_set(opened: Opened) -> None:
    scene = await opened()
    goal = made(STAMPED, header=header("a/map"), pose=pose(0.6, 0.0, 1.0))
    await published(scene, "/a/goal_pose", STAMPED, goal)
    await scene.peer.until(lambda: not scene.robot.actions.running(), 60.0)
    assert scene.robot[Localization].pose.x == pytest.approx(0.6, abs=0.1)
    covariance = made("geometry_msgs/msg/PoseWithCovariance", pose=pose(2.0, 1.0), covariance=np.zeros(36))
    there = made(WITH_COVARIANCE, header=header("map"), pose=covariance)
    await published(scene, "/a/initialpose", WITH_COVARIANCE, there)
    assert scene.robot[Localization].pose.x == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("length", [1e200, 3.0, 1e-300])
async def test_a_quaternion_of_any_length_turns(opened: Opened, length: float) -> None:
    scene = await opened()
    turn = made("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=length * math.sin(0.5), w=length * math.cos(0.5))
    tilted = made("geometry_msgs/msg/Quaternion", x=0.0, y=length, z=0.0, w=0.0)
    for orientation, yaw in ((turn, 1.0), (tilted, math.pi)):
        there = made(
            WITH_COVARIANCE,
            header=header("map"),
            pose=made(
                "geometry_msgs/msg/PoseWithCovariance",
                pose=made(
                    "geometry_msgs/msg/Pose",
                    position=made("geometry_msgs/msg/Point", x=1.0, y=0.0, z=0.0),
                    orientation=orientation,
                ),
                covariance=np.zeros(36),
            ),
        )
        await published(scene, "/a/initialpose", WITH_COVARIANCE, there)
        assert math.cos(scene.robot[Localization].pose.yaw - yaw) > 0.99


async def test_refused_commands_are_logged(opened: Opened) -> None:
    scene = await opened()
    peer: Peer = scene.peer
    peer.listen("/rosout", LOG)
    await scene.robot[Lease].take()
    lines = peer.heard["/rosout"]
    await published(scene, "/a/cmd_vel", TWIST, FORWARD)
    await peer.until(lambda: any("control is taken by a person" in line.msg for line in lines))
    await scene.robot[Lease].release()
    await published(scene, "/a/cmd_vel", TWIST, b"\x00\x01")
    await published(scene, "/a/cmd_vel", TWIST, bytes(200_000))
    await peer.until(lambda: any("at most 65536 bytes" in line.msg for line in lines))
    await peer.until(lambda: any("cannot be read" in line.msg for line in lines))
    await published(scene, "/a/cmd_vel", TWIST, made(TWIST, linear=vector(math.nan), angular=vector()))
    await published(scene, "/a/goal_pose", STAMPED, made(STAMPED, header=header("moon"), pose=pose(0, 0)))
    await peer.until(lambda: any("no frame 'moon'" in line.msg for line in lines))
    assert not scene.robot.actions.running()


async def test_another_namespace(opened: Opened) -> None:
    scene = await opened(namespaces={"a": ""})
    scene.peer.listen("/odom", "nav_msgs/msg/Odometry")
    await scene.peer.until(lambda: scene.peer.heard["/odom"], 2.0)
    await published(scene, "/cmd_vel", TWIST, FORWARD)
    assert scene.robot.actions.running()
