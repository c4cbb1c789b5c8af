"""Our own recordings (``roboglot up --record``): scans and odometry of one robot from the MCAP file.

Of several robots, the one with most scans is read. As the file has no limits of the lidar, the farthest echo counts.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roboglot.datasets.drive_log import RAYS_MAX, SCANS_MAX, BadDriveLog, DriveLog, RecordedScan
from roboglot.datasets.track import Track, with_odometry
from roboglot.extras import explaining
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.model.sensing import LaserScan

if TYPE_CHECKING:
    from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
    from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan as ScanMessage
    from google.protobuf.timestamp_pb2 import Timestamp

MAGIC = b"\x89MCAP0"
SCAN, TRANSFORMS = "foxglove.LaserScan", "foxglove.FrameTransforms"
RANGE_MIN = 0.05  # m


def read_own_recording(path: Path) -> DriveLog:
    """Read the recording at ``path``, even if it is cut off. Raises BadDriveLog, MissingExtra, OSError."""
    with explaining("reading recordings", "recording"):
        decoding = import_module("google.protobuf.message")
        from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
        from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan as ScanMessage
    scans: dict[str, list[ScanMessage]] = {}
    tracks: dict[str, Track] = {}
    mounts: dict[str, Pose] = {}
    unread: Counter[str] = Counter()
    for schema, data in _messages(path):
        try:
            if schema == SCAN:
                message = ScanMessage.FromString(data)
                _keep(scans.setdefault(message.frame_id.removesuffix("/laser"), []), message, path)
            else:
                for transform in FrameTransforms.FromString(data).transforms:
                    _take(transform, tracks, mounts)
        except decoding.DecodeError:
            unread["damaged messages"] += 1
    if not scans:
        raise BadDriveLog(f"{path.name}: no scans; a folder of rosbag2 is read by its folder")
    robot = max(sorted(scans), key=lambda name: len(scans[name]))
    unread.update({f"scans of {name}": len(found) for name, found in scans.items() if name != robot})
    track, mount = tracks.get(robot, Track()), mounts.get(robot, ORIGIN)
    reach = max((_farthest(message) for message in scans[robot]), default=0.0) or RANGE_MIN
    recorded = [
        RecordedScan(_scan(message, stamp, reach, mount), odometry)
        for message, stamp, odometry in with_odometry(scans[robot], _stamp_of, track, unread)
    ]
    if not recorded:
        raise BadDriveLog(f"{path.name}: no scan of {robot} has odometry near its time")
    return DriveLog(path.stem, recorded, dict(unread))


def _messages(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield schema and bytes of scans and transforms."""
    with explaining("reading recordings", "recording"):
        from mcap.records import Channel, Message, Schema

        from roboglot.wire.mcap_chunks import stream_of
        from roboglot.wire.mcap_damage import DAMAGE
    schemas: dict[int, str] = {}
    channels: dict[int, str] = {}
    with path.open("rb") as file:
        try:
            for record in stream_of(file):
                if isinstance(record, Schema):
                    schemas[record.id] = record.name
                elif isinstance(record, Channel):
                    channels[record.id] = schemas.get(record.schema_id, "")
                elif isinstance(record, Message) and (kind := channels.get(record.channel_id)) in (SCAN, TRANSFORMS):
                    yield str(kind), record.data
        except DAMAGE:
            return  # the program was killed; the complete records count


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


def _scan(message: ScanMessage, stamp: float, reach: float, mount: Pose) -> LaserScan:
    ranges = np.array(message.ranges, np.float32)
    with np.errstate(invalid="ignore"):
        ranges[ranges < RANGE_MIN] = np.nan
    ranges.setflags(write=False)
    increment = (message.end_angle - message.start_angle) / max(1, len(ranges) - 1)
    return LaserScan(stamp, ranges, message.start_angle, increment, RANGE_MIN, reach + 1e-3, mount=mount)


def _stamp_of(message: ScanMessage) -> float:
    return _seconds(message.timestamp)


def _seconds(stamp: Timestamp) -> float:
    return float(stamp.seconds) + 1e-9 * float(stamp.nanos)
