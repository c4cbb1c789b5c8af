"""The messages that Foxglove and its kin draw, from the model's values; protobuf, as their schemas have them.

Frames are per robot: ``a/map -> a/odom -> a/base_link -> a/laser``; the truth is in ``world``.
"""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from foxglove_schemas_protobuf import (
    CompressedVideo_pb2,
    FrameTransforms_pb2,
    Grid_pb2,
    LaserScan_pb2,
    Log_pb2,
    PackedElementField_pb2,
    PoseInFrame_pb2,
    SceneUpdate_pb2,
)
from google.protobuf.descriptor_pb2 import FileDescriptorSet

from roboglot.model.geometry import Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.sensing import LaserScan

if TYPE_CHECKING:
    from foxglove_schemas_protobuf.Pose_pb2 import Pose as PoseMessage
    from google.protobuf.descriptor import FileDescriptor
    from google.protobuf.message import Message
    from google.protobuf.timestamp_pb2 import Timestamp

PARTS_A_METRE = 1024.0  # ranges are rounded to a millimetre, to numbers with trailing zero bits, which compress well
LEVELS = {10: 1, 20: 2, 30: 3, 40: 4, 50: 5}  # of Python's logging module
TYPES: dict[str, type[Message]] = {
    "foxglove.CompressedVideo": CompressedVideo_pb2.CompressedVideo,
    "foxglove.FrameTransforms": FrameTransforms_pb2.FrameTransforms,
    "foxglove.Grid": Grid_pb2.Grid,
    "foxglove.LaserScan": LaserScan_pb2.LaserScan,
    "foxglove.Log": Log_pb2.Log,
    "foxglove.PoseInFrame": PoseInFrame_pb2.PoseInFrame,
    "foxglove.SceneUpdate": SceneUpdate_pb2.SceneUpdate,
}

RANGES = bytes([6 << 3 | 2])  # the field of a scan


@cache
def schema(name: str) -> bytes:
    """Return the descriptors of a message and of all that it is made of."""
    files: dict[str, FileDescriptor] = {}

    def collect(file: FileDescriptor) -> None:
        for needed in file.dependencies:
            collect(needed)
        files.setdefault(file.name, file)

    collect(TYPES[name].DESCRIPTOR.file)
    found = FileDescriptorSet()
    for file in files.values():
        file.CopyToProto(found.file.add())
    return bytes(found.SerializeToString())


def _stamp(message: Timestamp, nanoseconds: int) -> None:
    message.seconds, message.nanos = divmod(nanoseconds, 1_000_000_000)


def _place(message: PoseMessage, pose: Pose, z: float = 0.0) -> None:
    message.position.x, message.position.y, message.position.z = pose.x, pose.y, z
    message.orientation.z, message.orientation.w = math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)


def encode_pose(at: int, value: tuple[str, Pose]) -> bytes:
    """``value``: frame and pose."""
    message = PoseInFrame_pb2.PoseInFrame(frame_id=value[0])
    _stamp(message.timestamp, at)
    _place(message.pose, value[1])
    return bytes(message.SerializeToString())


def encode_transforms(at: int, value: tuple[tuple[str, str, Pose], ...]) -> bytes:
    """``value``: parent, child, and the child's pose in the parent."""
    message = FrameTransforms_pb2.FrameTransforms()
    for parent, child, pose in value:
        transform = message.transforms.add(parent_frame_id=parent, child_frame_id=child)
        _stamp(transform.timestamp, at)
        transform.translation.x, transform.translation.y = pose.x, pose.y
        transform.rotation.z, transform.rotation.w = math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)
    return bytes(message.SerializeToString())


def encode_scan(at: int, value: tuple[str, LaserScan]) -> bytes:
    """``value``: frame and scan. What was not seen is infinite, what is not known is not a number."""
    frame, scan = value
    ranges = np.round(scan.ranges * PARTS_A_METRE).astype(np.float64) / PARTS_A_METRE
    message = LaserScan_pb2.LaserScan(
        frame_id=frame,
        start_angle=scan.angle_min,
        end_angle=scan.angle_min + scan.angle_increment * (len(ranges) - 1),
    )
    message.pose.orientation.w = 1.0
    _stamp(message.timestamp, at)
    # The ranges' field is the last one, and packed: its bytes are the array's.
    return bytes(message.SerializeToString()) + RANGES + _varint(ranges.nbytes) + ranges.astype("<f8").tobytes()


def _varint(number: int) -> bytes:
    """Return the length of a field, seven bits a byte."""
    found = bytearray()
    while number > 0x7F:
        found.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*found, number])


def encode_grid(at: int, value: tuple[str, OccupancyGrid]) -> bytes:
    """``value``: frame and map; the field ``occupancy`` is ROS': -1 unknown, 0 free, 100 occupied."""
    frame, grid = value
    cells = np.zeros(grid.log_odds.shape, np.int8)
    cells[grid.log_odds > 0] = 100
    cells[grid.log_odds == 0] = -1
    message = Grid_pb2.Grid(
        frame_id=frame, column_count=grid.width, row_stride=grid.width, cell_stride=1, data=cells.tobytes()
    )
    message.fields.add(name="occupancy", offset=0, type=PackedElementField_pb2.PackedElementField.INT8)
    message.cell_size.x = message.cell_size.y = grid.resolution
    _stamp(message.timestamp, at)
    _place(message.pose, Pose(grid.origin.x, grid.origin.y))
    return bytes(message.SerializeToString())


def encode_log(at: int, value: tuple[int, str, str]) -> bytes:
    """``value``: Python's level, logger, text."""
    level, name, text = value
    message = TYPES["foxglove.Log"](level=LEVELS.get(level, 0), name=name, message=text)
    _stamp(message.timestamp, at)
    return bytes(message.SerializeToString())


def encode_scene(at: int, value: tuple[tuple[str, str, Pose, float, float, bool], ...]) -> bytes:
    """``value``: for each figure its name, frame, pose, radius and height (m), and whether it moves with the frame."""
    message = SceneUpdate_pb2.SceneUpdate()
    for name, frame, pose, radius, height, locked in value:
        entity = message.entities.add(id=name, frame_id=frame, frame_locked=locked)
        _stamp(entity.timestamp, at)
        body = entity.cylinders.add(bottom_scale=1.0, top_scale=1.0)
        _place(body.pose, pose, height / 2)
        body.size.x = body.size.y = 2 * radius
        body.size.z = height
        body.color.r, body.color.g, body.color.b, body.color.a = 0.3, 0.5, 0.9, 0.6
    return bytes(message.SerializeToString())


def encode_video(at: int, value: tuple[str, bytes]) -> bytes:
    """``value``: frame and one H.264 access unit (Annex B)."""
    message = CompressedVideo_pb2.CompressedVideo(frame_id=value[0], format="h264", data=value[1])
    _stamp(message.timestamp, at)
    return bytes(message.SerializeToString())
