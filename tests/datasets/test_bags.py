"""Bags of ROS, written by the library that others use: each reads as the drive that it is."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboglot.datasets.drive_log import BadDriveLog
from roboglot.datasets.formats import read_drive_log
from roboglot.model.geometry import Pose

highlevel = pytest.importorskip("rosbags.rosbag2")
from rosbags.rosbag2 import StoragePlugin, Writer  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402

STORE = get_typestore(Stores.ROS2_HUMBLE)
MOUNT = Pose(0.2, 0.0, math.pi / 2)
COUNT = 12


def message(kind: str, **fields: Any) -> Any:
    return STORE.types[kind](**fields)


def header(stamp: float, frame: str) -> Any:
    time = message("builtin_interfaces/msg/Time", sec=int(stamp), nanosec=round(stamp % 1 * 1e9))
    return message("std_msgs/msg/Header", stamp=time, frame_id=frame)


def turned(yaw: float) -> Any:
    return message("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def rolled(yaw: float, roll: float) -> Any:
    """Return the rotation by ``roll``, then by ``yaw``."""
    c, s, d, t = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(roll / 2), math.sin(roll / 2)
    return message("geometry_msgs/msg/Quaternion", x=c * t, y=s * t, z=s * d, w=c * d)


def transform(stamp: float, above: str, frame: str, pose: Pose, roll: float = 0.0) -> Any:
    place = message("geometry_msgs/msg/Vector3", x=pose.x, y=pose.y, z=0.0)
    inner = message("geometry_msgs/msg/Transform", translation=place, rotation=rolled(pose.yaw, roll))
    kind = "geometry_msgs/msg/TransformStamped"
    return message(kind, header=header(stamp, above), child_frame_id=frame, transform=inner)


def odometry(stamp: float, pose: Pose) -> Any:
    place = message("geometry_msgs/msg/Point", x=pose.x, y=pose.y, z=0.0)
    at = message("geometry_msgs/msg/Pose", position=place, orientation=turned(pose.yaw))
    zero = message("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
    still = message("geometry_msgs/msg/Twist", linear=zero, angular=zero)
    return message(
        "nav_msgs/msg/Odometry",
        header=header(stamp, "odom"),
        child_frame_id="base_link",
        pose=message("geometry_msgs/msg/PoseWithCovariance", pose=at, covariance=np.zeros(36)),
        twist=message("geometry_msgs/msg/TwistWithCovariance", twist=still, covariance=np.zeros(36)),
    )


def scan(stamp: float, count: int) -> Any:
    ranges = np.full(count, 2.0, np.float32)
    ranges[0], ranges[1], ranges[2] = np.inf, 0.0, 99.0
    return message(
        "sensor_msgs/msg/LaserScan",
        header=header(stamp, "laser"),
        angle_min=-1.0,
        angle_max=1.0,
        angle_increment=2.0 / (count - 1),
        time_increment=0.0,
        scan_time=0.1,
        range_min=0.1,
        range_max=30.0,
        ranges=ranges,
        intensities=np.zeros(0, np.float32),
    )


def bag(path: Path, plugin: StoragePlugin, *, by_tf: bool = False, roll: float = 0.0) -> Path:
    """Return a drive along x at 0.5 m/s; odometry comes 20 ms before each scan."""
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        tf = writer.add_connection("/tf", "tf2_msgs/msg/TFMessage", typestore=STORE)
        wheels = writer.add_connection("/odom", "nav_msgs/msg/Odometry", typestore=STORE)
        laser = writer.add_connection("/scan", "sensor_msgs/msg/LaserScan", typestore=STORE)

        def write(connection: Any, stamp: float, content: Any) -> None:
            writer.write(connection, round(stamp * 1e9), STORE.serialize_cdr(content, connection.msgtype))

        mount = transform(9.0, "base_link", "plate", Pose(), roll), transform(9.0, "plate", "laser", MOUNT)
        write(tf, 9.0, message("tf2_msgs/msg/TFMessage", transforms=list(mount)))
        for number in range(COUNT + 1):
            stamp = 10.0 + 0.1 * number
            pose = Pose(0.5 * (stamp - 0.02 - 10.0))
            if by_tf:
                moved = transform(stamp - 0.02, "odom", "base_footprint", pose)
                write(tf, stamp - 0.02, message("tf2_msgs/msg/TFMessage", transforms=[moved]))
            else:
                write(wheels, stamp - 0.02, odometry(stamp - 0.02, pose))
            if number < COUNT:
                write(laser, stamp, scan(stamp, 181))
    return path


@pytest.mark.parametrize("plugin", list(StoragePlugin))
@pytest.mark.parametrize("by_tf", [False, True])
def test_ros_2_bag_equals_the_drive_it_records(tmp_path: Path, plugin: StoragePlugin, by_tf: bool) -> None:
    log = read_drive_log(bag(tmp_path / "drive", plugin, by_tf=by_tf))
    assert len(log.scans) == COUNT
    for item in log.scans:
        assert item.odometry.x == pytest.approx(0.5 * (item.scan.stamp - 10.0), abs=1e-6)
        assert (item.scan.mount.x, item.scan.mount.yaw) == pytest.approx((MOUNT.x, MOUNT.yaw))
        assert np.isposinf(item.scan.ranges[[0, 2]]).all()
        assert np.isnan(item.scan.ranges[1])


def test_hanging_lasers_turn_the_other_way(tmp_path: Path) -> None:
    for name, roll in (("standing", 0.0), ("hanging", math.pi)):
        scan = read_drive_log(bag(tmp_path / name, StoragePlugin.SQLITE3, roll=roll)).scans[0].scan
        way = math.cos(roll)
        # The plate turns with the laser: what was to the left is to the right.
        assert scan.mount.yaw == pytest.approx(way * MOUNT.yaw)
        assert scan.angles[[0, -1]] == pytest.approx([-way, way])
    with pytest.raises(BadDriveLog, match="tilted"):
        read_drive_log(bag(tmp_path / "leaning", StoragePlugin.SQLITE3, roll=0.5))


def test_a_bag_without_what_is_needed_says_so(tmp_path: Path) -> None:
    with Writer(tmp_path / "bag", version=9) as writer:
        writer.add_connection("/odom", "nav_msgs/msg/Odometry", typestore=STORE)
    with pytest.raises(BadDriveLog, match="LaserScan"):
        read_drive_log(tmp_path / "bag")
    (tmp_path / "folder").mkdir()
    with pytest.raises(BadDriveLog, match=r"metadata\.yaml"):
        read_drive_log(tmp_path / "folder")


def test_a_damaged_bag_is_refused(tmp_path: Path) -> None:
    folder = bag(tmp_path / "drive", StoragePlugin.SQLITE3, by_tf=False)
    (file,) = folder.glob("*.db3")
    file.write_bytes(b"\0" * 4096)
    with pytest.raises(BadDriveLog):
        read_drive_log(folder)
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: [")
    with pytest.raises(BadDriveLog):
        read_drive_log(folder)
