"""Messages for Foxglove and similar viewers, made from the model's values; protobuf, by Foxglove's schemas.

Frames are per robot: ``a/map -> a/odom -> a/base_link -> a/laser``; the truth is in ``world``.
"""

from __future__ import annotations

import math
from functools import cache, lru_cache
from struct import Struct
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

UPRIGHT = b"\x1a\x0b\x12\x09\x21" + Struct("<d").pack(1.0)  # a scan's pose: no turn
_three_doubles = Struct("<3d")
_one_double, _two_doubles = Struct("<Bd").pack, Struct("<BdBd").pack
_four_doubles = Struct("<BBBdBdBBBdBd").pack


@cache
def schema(name: str) -> bytes:
    """Return the descriptors of a message and of its dependencies."""
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


# Poses, transforms and scans come ten times a second from each robot. They are encoded by hand, in a third of the
# library's time; tests/recording/test_messages.py compares the bytes with the library's.


@lru_cache(maxsize=16)  # all robots are looked at in one instant
def _time_field(nanoseconds: int) -> bytes:
    """Return field 1, a Timestamp."""
    seconds, nanos = divmod(nanoseconds, 1_000_000_000)
    return _field(1, _seconds_field(seconds) + (b"\x10" + _varint(nanos) if nanos else b""))


@lru_cache(maxsize=16)
def _seconds_field(seconds: int) -> bytes:
    return b"\x08" + _varint(seconds) if seconds else b""


@lru_cache(maxsize=4096)
def _text_fields(*texts: str) -> bytes:
    """Return the texts as fields 2, 3 and so on; empty ones are left out."""
    return b"".join(_field(number, text.encode()) for number, text in enumerate(texts, 2) if text)


def _field(number: int, data: bytes) -> bytes:
    """Return a field of bytes, a string or a message."""
    return _field_head(number, len(data)) + data


@lru_cache(maxsize=1024)
def _field_head(number: int, size: int) -> bytes:
    return bytes([number << 3 | 2]) + _varint(size)


def _doubles(first: int, a: float, second: int, b: float) -> bytes:
    """Return a length and two double fields; zeros are left out, as protobuf does."""
    fields = [_one_double(n << 3 | 1, v) for n, v in ((first, a), (second, b)) if v or math.copysign(1.0, v) < 0]
    return bytes([9 * len(fields)]) + b"".join(fields)


@lru_cache(maxsize=1024)
def _upright_fields(number: int, pose: bytes) -> bytes:
    """Return ``_place_fields`` of a pose with a zero in it, as most mounts have; ``pose``: its three packed doubles."""
    x, y, yaw = _three_doubles.unpack(pose)
    tag, z, w = number << 3 | 2, math.sin(yaw / 2), math.cos(yaw / 2)
    return bytes([tag]) + _doubles(1, x, 2, y) + bytes([tag + 8]) + _doubles(3, z, 4, w)


def _place_fields(number: int, pose: Pose) -> bytes:
    """Return a field with the position (x, y) and the next one with the rotation (z, w of a quaternion)."""
    x, y, yaw = pose.x, pose.y, pose.yaw
    z, w, tag = math.sin(yaw / 2), math.cos(yaw / 2), number << 3 | 2
    if x and y and z and w:
        return _four_doubles(tag, 18, 9, x, 17, y, tag + 8, 18, 25, z, 33, w)
    return _upright_fields(number, _three_doubles.pack(x, y, yaw))


def encode_pose(at: int, value: tuple[str, Pose]) -> bytes:
    """``value``: frame and pose."""
    frame, pose = value
    return _time_field(at) + _text_fields(frame) + _field(3, _place_fields(1, pose))


def encode_transforms(at: int, value: tuple[tuple[str, str, Pose], ...]) -> bytes:
    """``value``: parent, child, and the child's pose in the parent."""
    time = _time_field(at)
    return b"".join(
        [_field(1, time + _text_fields(parent, child) + _place_fields(4, pose)) for parent, child, pose in value]
    )


def encode_scan(at: int, value: tuple[str, LaserScan]) -> bytes:
    """``value``: frame and scan. Ranges without an echo are infinite, unknown ones NaN."""
    frame, scan = value
    parts = np.rint(scan.ranges * PARTS_A_METRE)
    ranges = np.multiply(parts, 1.0 / PARTS_A_METRE, dtype="<f8")
    start = scan.angle_min
    end = start + scan.angle_increment * (len(ranges) - 1)
    angles = _two_doubles(33, start, 41, end) if start and end else _doubles(4, start, 5, end)[1:]
    return b"".join((_time_field(at), _text_fields(frame), UPRIGHT, angles, _field_head(6, ranges.nbytes), ranges))


def _varint(number: int) -> bytes:
    """Return a number (a field's length, say), seven bits a byte."""
    if number <= 0x7F:
        return bytes([number])
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
    """``value``: name, frame, pose, radius (m), height (m) of each figure, and True if it moves with the frame."""
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
