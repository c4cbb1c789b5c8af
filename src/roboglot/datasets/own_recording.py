"""Our own recordings (``roboglot up --record``): scans and odometry of one robot from the MCAP file.

If it has several robots, the one with the most scans is read. In a file without the lidar's limits, the farthest echo
is its range.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from roboglot.datasets.drive_log import RAYS_MAX, SCANS_MAX, BadDriveLog, DriveLog, RecordedScan
from roboglot.datasets.track import Track, with_odometry
from roboglot.extras import explaining
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.model.sensing import LaserScan
from roboglot.text_files import open_bytes

if TYPE_CHECKING:
    from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
    from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan as ScanMessage
    from google.protobuf.timestamp_pb2 import Timestamp

MAGIC = b"\x89MCAP0"
SCAN, TRANSFORMS, LIMITS = "foxglove.LaserScan", "foxglove.FrameTransforms", "roboglot.Lidar"
RANGE_MIN = 0.05  # m


class _Limits(msgspec.Struct, frozen=True):
    """Properties of the lidar for which the scan's message has no fields; see ``LaserScan``."""

    range_max: float
    range_min: float = RANGE_MIN
    clear_range: float = 4.0
    time_increment: float = 0.0


def read_own_recording(path: Path) -> DriveLog:
    """Read the recording at ``path``, even if it is cut off. Raises BadDriveLog, MissingExtra, OSError."""
    with explaining("reading recordings", "recording"):
        decoding = import_module("google.protobuf.message")
        from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
        from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan as ScanMessage
    scans: dict[str, list[ScanMessage]] = {}
    tracks: dict[str, Track] = {}
    mounts: dict[str, Pose] = {}
    limits: dict[str, _Limits] = {}
    unread: Counter[str] = Counter()
    for topic, schema, data in _messages(path):
        try:
            if schema == LIMITS:
                limits[topic.lstrip("/").partition("/")[0]] = msgspec.json.decode(data, type=_Limits)
            elif schema == SCAN:
                message = ScanMessage.FromString(data)
                _keep(scans.setdefault(message.frame_id.removesuffix("/laser"), []), message, path)
            else:
                for transform in FrameTransforms.FromString(data).transforms:
                    _take(transform, tracks, mounts)
        except (decoding.DecodeError, msgspec.MsgspecError):
            unread["damaged messages"] += 1
    if not scans:
        raise BadDriveLog(f"{path.name}: no scans; to read a rosbag2 recording, name its folder")
    robot = max(sorted(scans), key=lambda name: len(scans[name]))
    unread.update({f"scans of {name}": len(found) for name, found in scans.items() if name != robot})
    track, mount = tracks.get(robot, Track()), mounts.get(robot, ORIGIN)
    known = limits.get(robot) or _Limits(max(map(_farthest, scans[robot])) or RANGE_MIN)
    recorded = [
        RecordedScan(_scan(message, stamp, known, mount), odometry)
        for message, stamp, odometry in with_odometry(scans[robot], _stamp_of, track, unread)
    ]
    if not recorded:
        raise BadDriveLog(f"{path.name}: no scan of {robot} has odometry near its time")
    return DriveLog(path.stem, recorded, dict(unread))


def _messages(path: Path) -> Iterator[tuple[str, str, bytes]]:
    """Yield topic, schema and bytes of scans, lidars' limits and transforms."""
    with explaining("reading recordings", "recording"):
        from mcap.records import Channel, Message, Schema

        from roboglot.wire.mcap_chunks import stream_of
        from roboglot.wire.mcap_damage import DAMAGE
    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}  # topic and schema
    with open_bytes(path) as file:
        try:
            for record in stream_of(file):
                if isinstance(record, Schema):
                    schemas[record.id] = record.name
                elif isinstance(record, Channel):
                    kind = schemas.get(record.schema_id, "")
                    if kind in (SCAN, LIMITS, TRANSFORMS):
                        channels[record.id] = record.topic, kind
                elif isinstance(record, Message) and record.channel_id in channels:
                    yield *channels[record.channel_id], record.data
        except DAMAGE:
            return  # the program that wrote it was killed: only the complete records are read


def _keep(found: list[ScanMessage], message: ScanMessage, path: Path) -> None:
    if len(found) >= SCANS_MAX or len(message.ranges) > RAYS_MAX:
        raise BadDriveLog(f"{path.name}: more than {SCANS_MAX} scans or {RAYS_MAX} rays")
    found.append(message)


def _take(transform: FrameTransform, tracks: dict[str, Track], mounts: dict[str, Pose]) -> None:
    robot, _, frame = transform.child_frame_id.rpartition("/")
    pose = Pose(
        transform.translation.x, transform.translation.y, 2.0 * math.atan2(transform.rotation.z, transform.rotation.w)
    )
    if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
        return
    if frame == "base_link" and transform.parent_frame_id == f"{robot}/odom":
        tracks.setdefault(robot, Track()).add(_seconds(transform.timestamp), pose)
    elif frame == "laser":
        mounts[robot] = pose


def _farthest(message: ScanMessage) -> float:
    ranges = np.array(message.ranges)
    return float(ranges[np.isfinite(ranges)].max(initial=0.0))


def _scan(message: ScanMessage, stamp: float, limits: _Limits, mount: Pose) -> LaserScan:
    ranges = np.array(message.ranges, np.float32)
    with np.errstate(invalid="ignore"):
        ranges[ranges < limits.range_min] = np.nan
    ranges.setflags(write=False)
    increment = (message.end_angle - message.start_angle) / max(1, len(ranges) - 1)
    return LaserScan(
        stamp,
        ranges,
        message.start_angle,
        increment,
        limits.range_min,
        limits.range_max + 1e-3,  # ranges are recorded to a millimetre
        mount=mount,
        time_increment=limits.time_increment,
        clear_range=limits.clear_range,
    )


def _stamp_of(message: ScanMessage) -> float:
    return _seconds(message.timestamp)


def _seconds(stamp: Timestamp) -> float:
    return float(stamp.seconds) + 1e-9 * float(stamp.nanos)
