"""ROS bags: rosbag2 (a folder with SQLite or MCAP files) and ROS 1's ``.bag``; needs ``roboglot[logs]``.

Reads one laser (the topic with the most scans), one odometry (``nav_msgs/Odometry``, else odom -> base_link in tf), and
the laser's mount from tf. Without one, the laser is taken to be at the origin of base_link.
"""

from __future__ import annotations

import functools
import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from roboglot.datasets.drive_log import RAYS_MAX, SCANS_MAX, BadDriveLog, DriveLog, RecordedScan
from roboglot.datasets.mounts import level_mount, rotation
from roboglot.datasets.track import Track, with_odometry
from roboglot.extras import explaining
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.sensing import LaserScan

SCAN, ODOMETRY = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
ODOM_FRAMES, BASE_FRAMES = ("odom",), ("base_link", "base_footprint")
CHAIN_MAX = 16  # frames between base and laser
RAY_SECONDS_MAX = 0.01  # plausible s between two rays
Frames = dict[str, tuple[str, NDArray[np.float64]]]  # frame: its parent, and its pose there as a matrix (4, 4)


class Stamp(Protocol):
    """builtin_interfaces/Time."""

    sec: int
    nanosec: int


class Header(Protocol):
    """std_msgs/Header."""

    stamp: Stamp
    frame_id: str


class Vector(Protocol):
    """geometry_msgs/Point or Vector3."""

    x: float
    y: float
    z: float


class Quaternion(Vector, Protocol):
    """geometry_msgs/Quaternion."""

    w: float


class Transform(Protocol):
    """geometry_msgs/Transform."""

    translation: Vector
    rotation: Quaternion


class TransformStamped(Protocol):
    """geometry_msgs/TransformStamped."""

    header: Header
    child_frame_id: str
    transform: Transform


class ScanMessage(Protocol):
    """sensor_msgs/LaserScan."""

    header: Header
    angle_min: float
    angle_increment: float
    time_increment: float
    range_min: float
    range_max: float
    ranges: NDArray[np.float32]


def is_bag(path: Path, head: bytes) -> bool:
    """Return whether this is a bag: a rosbag2 folder, a file in one, or a ROS 1 bag."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file()
    return head.startswith(b"#ROSBAG V2.0") or (path.suffix in (".db3", ".mcap") and _folder(path) is not None)


def _folder(path: Path) -> Path | None:
    return path.parent if (path.parent / "metadata.yaml").is_file() else None


def read_bag(path: Path) -> DriveLog:
    """Read the bag at ``path``. Raises BadDriveLog, MissingExtra, OSError."""
    with explaining("reading bags of ROS", "logs"):
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    bag = path if path.is_dir() or path.suffix == ".bag" else path.parent
    try:
        with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            counts = Counter({c.topic: c.msgcount for c in reader.connections if c.msgtype == SCAN})
            if not counts:
                raise BadDriveLog(f"{path.name}: no topic of type {SCAN}")
            laser = max(sorted(counts), key=lambda topic: counts[topic])
            wanted = [c for c in reader.connections if c.topic == laser or c.msgtype in (ODOMETRY, *TRANSFORMS)]
            messages = ((c.msgtype, at, reader.deserialize(raw, c.msgtype)) for c, at, raw in reader.messages(wanted))
            log = _assembled(path.stem, messages)
    except (AnyReaderError, AssertionError, ValueError, KeyError) as error:
        raise BadDriveLog(f"{path.name}: {error}") from None
    for topic, count in counts.items():
        if topic != laser:
            log.unread[f"scans of {topic}"] = count
    return log


def _assembled(name: str, messages: Iterator[tuple[str, int, Any]]) -> DriveLog:
    """Return scans with odometry, from messages in the order of arrival."""
    scans: list[ScanMessage] = []
    wheels, tf_wheels = Track(), Track()
    fixed: Frames = {}
    unread: Counter[str] = Counter()
    for kind, _, message in messages:
        if kind == SCAN:
            if len(scans) >= SCANS_MAX or len(message.ranges) > RAYS_MAX:
                raise BadDriveLog(f"{name}: more than {SCANS_MAX} scans or {RAYS_MAX} rays")
            scans.append(message)
        elif kind == ODOMETRY:
            wheels.add(_seconds(message.header.stamp), _pose(message.pose.pose.position, message.pose.pose.orientation))
        else:
            for transform in message.transforms:
                _take(transform, fixed, tf_wheels)
    track = wheels if len(wheels) else tf_wheels
    if not len(track):
        raise BadDriveLog(f"{name}: no odometry: neither {ODOMETRY} nor tf from odom to base_link")
    mounted = functools.cache(lambda frame: _mount(fixed, frame))
    recorded = [
        RecordedScan(_scan(message, stamp, *mounted(message.header.frame_id)), odometry)
        for message, stamp, odometry in with_odometry(scans, _stamp_of, track, unread)
    ]
    if not recorded:
        raise BadDriveLog(f"{name}: no scan has odometry near its time")
    recorded.sort(key=lambda item: item.scan.stamp)
    return DriveLog(name, recorded, dict(unread))


def _take(transform: TransformStamped, fixed: Frames, wheels: Track) -> None:
    """Keep a transform of tf: base_link in odom goes to ``wheels``, frames on the robot to ``fixed``."""
    above, frame = (name.strip("/") for name in (transform.header.frame_id, transform.child_frame_id))
    place, turned = transform.transform.translation, transform.transform.rotation
    if above in ODOM_FRAMES and frame in BASE_FRAMES:
        wheels.add(_seconds(transform.header.stamp), _pose(place, turned))
    elif above not in ("map", *ODOM_FRAMES) and len(fixed) < 1000:
        moved = np.eye(4)
        moved[:3, :3], moved[:3, 3] = rotation(turned.w, turned.x, turned.y, turned.z), (place.x, place.y, place.z)
        fixed[frame] = above, moved


def _mount(fixed: Frames, frame: str) -> tuple[Pose, bool]:
    """Return the laser's pose on the robot, and True if it is upside down; follows the parents in tf up to the base."""
    mount, below = np.eye(4), frame.strip("/")
    for _ in range(CHAIN_MAX):
        if below in BASE_FRAMES or below not in fixed:
            break
        below, moved = fixed[below]
        mount = moved @ mount
    if not np.isfinite(mount).all():
        raise BadDriveLog(f"the pose of {frame} is not finite")
    return level_mount(mount[:3, :3], float(mount[0, 3]), float(mount[1, 3]))


def _scan(message: ScanMessage, stamp: float, mount: Pose, flipped: bool) -> LaserScan:
    ranges = np.array(message.ranges, np.float32)
    with np.errstate(invalid="ignore"):
        ranges[ranges > message.range_max] = np.inf
        ranges[ranges < message.range_min] = np.nan  # drivers send 0 for missing echoes
    ranges.setflags(write=False)
    least, most = float(message.range_min), float(message.range_max)
    if not (math.isfinite(most) and 0.0 <= least < most and math.isfinite(message.angle_increment)):
        raise BadDriveLog("a scan has no valid range limits or angles")
    increment = float(message.time_increment)
    increment = increment if 0.0 < increment < RAY_SECONDS_MAX else 0.0
    way = -1.0 if flipped else 1.0  # seen from above
    angles = way * float(message.angle_min), way * float(message.angle_increment)
    return LaserScan(stamp, ranges, *angles, least, most, mount=mount, time_increment=increment)


def _stamp_of(message: ScanMessage) -> float:
    return _seconds(message.header.stamp)


def _seconds(stamp: Stamp) -> float:
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def _pose(position: Vector, q: Quaternion) -> Pose:
    """Return the planar part of the robot's pose."""
    yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    x, y = float(position.x), float(position.y)
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(yaw)):
        raise BadDriveLog("a pose is not finite")
    return Pose(x, y, wrap_angle(yaw))
