"""Another's library of ROS 2 over Zenoh reads the topics and drives: PYTHONPATH=/where/zenoh_ros2_sdk/is pytest …"""

from __future__ import annotations

import asyncio
import re
from typing import Any

import pytest

from roboglot.model.components.sensing.odometry import Odometry
from tests.protocols.ros2.conftest import ADDRESS, PORT, STORE, Opened

pytest.importorskip("zenoh_ros2_sdk", reason="needs zenoh-ros2-sdk")

TOPICS = {
    "/a/scan": "sensor_msgs/msg/LaserScan",
    "/a/odom": "nav_msgs/msg/Odometry",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/a/map": "nav_msgs/msg/OccupancyGrid",
    "/a/battery_state": "sensor_msgs/msg/BatteryState",
    "/a/joint_states": "sensor_msgs/msg/JointState",
    "/a/image/compressed": "sensor_msgs/msg/CompressedImage",
}


def definition(type: str) -> str:
    text: str = STORE.generate_msgdef(type)[0]
    return text


def test_its_own_type_hashes_are_ours() -> None:
    from zenoh_ros2_sdk.utils import get_type_hash

    for type in {*TOPICS.values(), "geometry_msgs/msg/Twist", "geometry_msgs/msg/PoseWithCovarianceStamped"}:
        first, *rest = definition(type).split("=" * 80 + "\n")
        needed = {}
        for part in rest:
            name, _, text = part.partition("\n")
            package, _, word = name.removeprefix("MSG: ").partition("/")
            needed[f"{package}/msg/{word}"] = text
        own = {"builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec\n"}
        parts = [re.sub(r"(?m)^time ", "builtin_interfaces/Time ", text) for text in (first, *needed.values())]
        found = get_type_hash(type, parts[0], dict(zip(needed, parts[1:], strict=True)) | own)
        assert found == STORE.hash_rihs01(type), type


async def test_it_reads_all_topics_and_drives(opened: Opened) -> None:
    from zenoh_ros2_sdk import ROS2Publisher, ROS2Subscriber
    from zenoh_ros2_sdk.qos import QosDurability, QosProfile

    scene = await opened()
    heard: dict[str, list[Any]] = {topic: [] for topic in TOPICS}
    ends: list[Any] = []

    def subscribe() -> None:
        for topic, type in TOPICS.items():
            kept = topic in ("/tf_static", "/a/map")
            ends.append(
                ROS2Subscriber(
                    topic,
                    type,
                    heard[topic].append,
                    msg_definition=definition(type),
                    type_hash=STORE.hash_rihs01(type),
                    router_ip=ADDRESS,
                    router_port=PORT,
                    qos=QosProfile(durability=QosDurability.TRANSIENT_LOCAL) if kept else None,
                )
            )

    await asyncio.to_thread(subscribe)
    try:
        await scene.peer.until(lambda: all(heard.values()), 8.0)
        assert heard["/a/scan"][-1].header.frame_id == "a/laser"
        twist = "geometry_msgs/msg/Twist"
        publisher = await asyncio.to_thread(
            lambda: ROS2Publisher(
                "/a/cmd_vel", twist, definition(twist), type_hash=STORE.hash_rihs01(twist), router_ip=ADDRESS
            )
        )
        ends.append(publisher)
        types = publisher.session_mgr.store.types
        vector = types["geometry_msgs/msg/Vector3"]
        publisher.publish(linear=vector(x=0.3, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.0))
        await scene.peer.until(lambda: scene.robot[Odometry].reading.pose.x > 0.05, 2.0)
    finally:
        for end in ends:
            await asyncio.to_thread(end.close)
