"""Recorded messages in ROS 2 types, as CDR: scans, frames, odometry, poses, maps, batteries, video, logs.

Values without a ROS type (exchanges of doors, events, actions, states) are JSON in a ``std_msgs/String``.
"""

from __future__ import annotations

import math
import struct
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict

import msgspec
import numpy as np
from google.protobuf.message import DecodeError
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from roboglot.model.geometry import Pose, wrap_angle
from roboglot.recording.foxglove import LEVELS, TYPES
from roboglot.recording.reader import Record
from roboglot.recording.readings import BY_SCHEMA, Reading

if TYPE_CHECKING:
    from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
    from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
    from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
    from foxglove_schemas_protobuf.Grid_pb2 import Grid
    from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
    from foxglove_schemas_protobuf.Log_pb2 import Log
    from foxglove_schemas_protobuf.Pose_pb2 import Pose as PoseMessage
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
    from numpy.typing import NDArray
    from rosbags.typesys.store import Msg, Msgarg

JSON = "std_msgs/msg/String"
# Of damaged messages: their own bytes, values that no ROS type holds, and those that are missing.
DAMAGE = (DecodeError, msgspec.MsgspecError, SerdeError, struct.error, LookupError, ArithmeticError, RecursionError)
ROS_LEVELS = {number: python for python, number in LEVELS.items()}  # rcl's levels equal Python's
SPEED_SPAN = 0.5  # s of poses from which a speed is computed
STORE = get_typestore(Stores.ROS2_JAZZY)


class _Battery(TypedDict, total=False):
    """The fields of ``roboglot.Battery`` that ROS has, too."""

    charging: bool
    voltage: float | None
    current: float | None
    percentage: float


class _Limits(TypedDict, total=False):
    """The fields of ``roboglot.Lidar`` that ROS has in each scan."""

    range_min: float
    range_max: float
    time_increment: float
    rate: float


class RosMessage(NamedTuple):
    """One message; ``kept``: late subscribers get the last one (transient local)."""

    topic: str
    type: str
    at: int  # ns since 1970
    data: bytes
    kept: bool = False


def read_cdr(data: bytes, type: str) -> object:
    """Return a decoded message. Raises ValueError for bad data."""
    try:
        return STORE.deserialize_cdr(data, type)
    except (SerdeError, struct.error, LookupError, AssertionError, OverflowError) as error:
        raise ValueError(f"{type}: {error}") from None


def _new(type: str, **fields: Msgarg) -> Msg:
    return STORE.types[type](**fields)


def _time(at: int) -> Msg:
    return _new("builtin_interfaces/msg/Time", sec=at // 1_000_000_000, nanosec=at % 1_000_000_000)


def _header(at: int, frame: str) -> Msg:
    return _new("std_msgs/msg/Header", stamp=_time(at), frame_id=frame)


def _pose(message: PoseMessage) -> Msg:
    place, turn = message.position, message.orientation
    return _new(
        "geometry_msgs/msg/Pose",
        position=_new("geometry_msgs/msg/Point", x=place.x, y=place.y, z=place.z),
        orientation=_new("geometry_msgs/msg/Quaternion", x=turn.x, y=turn.y, z=turn.z, w=turn.w),
    )


def _vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Msg:
    return _new("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def _robot_of(record: Record) -> str:
    """Return the name of the robot of a topic (``/a/scan``)."""
    return record.topic.lstrip("/").partition("/")[0]


class Ros2Translator:
    """Translates one recording, in its order, as speeds and ranges depend on earlier messages.

    ``robot``: only this robot's messages; empty: all.
    """

    def __init__(self, robot: str = "") -> None:
        self._robot = robot
        self._limits: dict[str, _Limits] = {}  # of lidars, by robot
        self._farthest: dict[str, float] = {}  # m, by robot: for recordings without the lidar's limits
        self._past: dict[str, deque[tuple[int, Pose]]] = {}
        self._mounts: dict[str, tuple[float, ...]] = {}
        self._by_schema: Mapping[str, Callable[[Record, Any], Iterator[RosMessage]]] = {
            "foxglove.LaserScan": self._scan,
            "foxglove.FrameTransforms": self._transforms,
            "foxglove.PoseInFrame": self._place,
            "foxglove.Grid": self._grid,
            "foxglove.CompressedVideo": self._video,
            "foxglove.Log": self._log,
        }

    def translate(self, record: Record) -> Iterator[RosMessage]:
        """Yield the ROS messages of ``record``. Raises ValueError for a damaged one."""
        if self._robot and record.topic != "/tf" and self._robot not in record.topic.split("/")[1:3]:
            return
        try:
            if record.schema in TYPES:
                handler = self._by_schema.get(record.schema)
                if handler is not None:
                    yield from handler(record, TYPES[record.schema].FromString(record.data))
            else:
                yield from self._own(record)
        except DAMAGE as error:
            raise ValueError(f"{record.topic}: {error}") from None

    def _own(self, record: Record) -> Iterator[RosMessage]:
        """Yield the messages of a record in our own JSON."""
        if record.schema == "roboglot.Battery":
            yield from self._battery(record, msgspec.json.decode(record.data, type=_Battery))
            yield self._json(record, f"{record.topic}/state")
        elif (reading := BY_SCHEMA.get(record.schema)) is not None:
            yield self._reading(record, reading)
        else:
            if record.schema == "roboglot.Lidar":
                self._limits[_robot_of(record)] = msgspec.json.decode(record.data, type=_Limits)
            yield self._json(record, record.topic)

    def _made(self, topic: str, type: str, at: int, message: object, *, kept: bool = False) -> RosMessage:
        return RosMessage(topic, type, at, bytes(STORE.serialize_cdr(message, type)), kept)

    def _json(self, record: Record, topic: str) -> RosMessage:
        text = _new(JSON, data=record.data.decode("utf-8", "replace"))
        return self._made(topic, JSON, record.at, text)

    def _scan(self, record: Record, message: LaserScan) -> Iterator[RosMessage]:
        ranges = np.array(message.ranges, np.float32)
        limits = self._limits.get(_robot_of(record)) or self._limits_so_far(record, ranges)
        reach, rate = limits.get("range_max", math.inf), limits.get("rate", 0.0)
        ranges[np.isfinite(ranges)] = ranges[np.isfinite(ranges)].clip(max=reach)  # recorded to a millimetre
        scan = _new(
            "sensor_msgs/msg/LaserScan",
            header=_header(record.at, message.frame_id),
            angle_min=message.start_angle,
            angle_max=message.end_angle,
            angle_increment=(message.end_angle - message.start_angle) / max(1, len(ranges) - 1),
            time_increment=limits.get("time_increment", 0.0),
            scan_time=1.0 / rate if rate > 0.0 else 0.0,
            range_min=limits.get("range_min", 0.0),
            range_max=reach,
            ranges=ranges,
            intensities=np.array([], np.float32),
        )
        yield self._made(record.topic, "sensor_msgs/msg/LaserScan", record.at, scan)

    def _limits_so_far(self, record: Record, ranges: NDArray[np.float32]) -> _Limits:
        """Return limits that fit the echoes of a robot so far."""
        robot = _robot_of(record)
        farthest = ranges[np.isfinite(ranges)].max(initial=self._farthest.get(robot, 0.0))
        self._farthest[robot] = float(farthest)
        return {"range_max": self._farthest[robot] + 1e-3}

    def _transforms(self, record: Record, message: FrameTransforms) -> Iterator[RosMessage]:
        moving = []
        for frame in message.transforms:
            robot, _, child = frame.child_frame_id.rpartition("/")
            if self._robot not in ("", robot):
                continue
            transform = self._transform(record.at, frame)
            if child == "laser":
                yield from self._mount(record.at, frame, transform)
                continue
            moving.append(transform)
            if child == "base_link":
                yield self._odometry(record.at, robot, frame)
        if moving:
            yield self._made(
                "/tf", "tf2_msgs/msg/TFMessage", record.at, _new("tf2_msgs/msg/TFMessage", transforms=moving)
            )

    def _transform(self, at: int, frame: FrameTransform) -> Msg:
        turn, way = frame.rotation, frame.translation
        return _new(
            "geometry_msgs/msg/TransformStamped",
            header=_header(at, frame.parent_frame_id),
            child_frame_id=frame.child_frame_id,
            transform=_new(
                "geometry_msgs/msg/Transform",
                translation=_vector(way.x, way.y, way.z),
                rotation=_new("geometry_msgs/msg/Quaternion", x=turn.x, y=turn.y, z=turn.z, w=turn.w),
            ),
        )

    def _mount(self, at: int, frame: FrameTransform, transform: Msg) -> Iterator[RosMessage]:
        """Yield the laser's mount if it has changed."""
        place = (frame.translation.x, frame.translation.y, frame.rotation.z, frame.rotation.w)
        if self._mounts.get(frame.child_frame_id) != place:
            self._mounts[frame.child_frame_id] = place
            message = _new("tf2_msgs/msg/TFMessage", transforms=[transform])
            yield self._made("/tf_static", "tf2_msgs/msg/TFMessage", at, message, kept=True)

    def _odometry(self, at: int, robot: str, frame: FrameTransform) -> RosMessage:
        way, turn = frame.translation, frame.rotation
        here = Pose(way.x, way.y, 2.0 * math.atan2(turn.z, turn.w))
        speed = self._speed(robot, at, here)
        message = _new(
            "nav_msgs/msg/Odometry",
            header=_header(at, frame.parent_frame_id),
            child_frame_id=frame.child_frame_id,
            pose=_new(
                "geometry_msgs/msg/PoseWithCovariance",
                pose=_new(
                    "geometry_msgs/msg/Pose",
                    position=_new("geometry_msgs/msg/Point", x=way.x, y=way.y, z=way.z),
                    orientation=_new("geometry_msgs/msg/Quaternion", x=turn.x, y=turn.y, z=turn.z, w=turn.w),
                ),
                covariance=np.zeros(36),
            ),
            twist=_new(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=_new("geometry_msgs/msg/Twist", linear=_vector(speed.x, speed.y), angular=_vector(z=speed.yaw)),
                covariance=np.zeros(36),
            ),
        )
        return self._made(f"/{robot}/odom", "nav_msgs/msg/Odometry", at, message)

    def _speed(self, robot: str, at: int, here: Pose) -> Pose:
        """Return the velocity in base_link (m/s, rad/s) over the last half second, as stamps of poses are inexact."""
        past = self._past.setdefault(robot, deque())
        while past and not 0.0 < at - past[0][0] <= SPEED_SPAN * 1e9:
            past.popleft()
        past.append((at, here))
        then, before = past[0]
        seconds = (at - then) / 1e9
        if seconds == 0.0:
            return Pose()
        way = here.relative_to(before)
        return Pose(way.x / seconds, way.y / seconds, wrap_angle(way.yaw) / seconds)

    def _place(self, record: Record, message: PoseInFrame) -> Iterator[RosMessage]:
        type = "geometry_msgs/msg/PoseStamped"
        pose = _new(type, header=_header(record.at, message.frame_id), pose=_pose(message.pose))
        yield self._made(record.topic, type, record.at, pose)

    def _grid(self, record: Record, message: Grid) -> Iterator[RosMessage]:
        cells = np.frombuffer(message.data, np.int8)
        width = message.column_count
        info = _new(
            "nav_msgs/msg/MapMetaData",
            map_load_time=_time(record.at),
            resolution=message.cell_size.x,
            width=width,
            height=len(cells) // width if width else 0,
            origin=_pose(message.pose),
        )
        type = "nav_msgs/msg/OccupancyGrid"
        grid = _new(type, header=_header(record.at, message.frame_id), info=info, data=cells)
        yield self._made(record.topic, type, record.at, grid, kept=True)

    def _video(self, record: Record, message: CompressedVideo) -> Iterator[RosMessage]:
        yield self._compressed(f"{record.topic}/compressed", record.at, message.frame_id, message.format, message.data)

    def picture(self, at: int, frame: str, jpeg: bytes) -> RosMessage:
        """Return a picture as a message; the caller sets its topic."""
        return self._compressed("", at, frame, "jpeg", jpeg)

    def _compressed(self, topic: str, at: int, frame: str, form: str, data: bytes) -> RosMessage:
        type = "sensor_msgs/msg/CompressedImage"
        picture = _new(type, header=_header(at, frame), format=form, data=np.frombuffer(data, np.uint8))
        return self._made(topic, type, at, picture)

    def joints(self, at: int, positions: Mapping[str, float]) -> RosMessage:
        """Return joint positions (rad) as a message; the caller sets its topic."""
        type, none = "sensor_msgs/msg/JointState", np.array([], np.float64)
        angles = np.array(list(positions.values()), np.float64)
        message = _new(type, header=_header(at, ""), name=list(positions), position=angles, velocity=none, effort=none)
        return self._made("", type, at, message)

    def _log(self, record: Record, message: Log) -> Iterator[RosMessage]:
        yield self.line(record.at, ROS_LEVELS.get(message.level, 20), message.name, message.message)

    def line(self, at: int, level: int, name: str, text: str) -> RosMessage:
        """Return a line of the log as a message."""
        type = "rcl_interfaces/msg/Log"
        line = _new(type, stamp=_time(at), level=level, name=name, msg=text, file="", function="", line=0)
        return self._made("/rosout", type, at, line)

    def _reading(self, record: Record, reading: Reading) -> RosMessage:
        header = _header(record.at, f"{_robot_of(record)}/base_link")
        values = reading.ros_fields(msgspec.json.decode(record.data, type=dict[str, float]))
        return self._made(record.topic, reading.ros, record.at, _new(reading.ros, header=header, **values))

    def _battery(self, record: Record, state: _Battery) -> Iterator[RosMessage]:
        type, unknown = "sensor_msgs/msg/BatteryState", math.nan
        charging = 1 if state.get("charging") else 2
        message = _new(
            type,
            header=_header(record.at, ""),
            voltage=float(state.get("voltage") or unknown),
            temperature=unknown,
            current=float(state.get("current") or 0.0),
            charge=unknown,
            capacity=unknown,
            design_capacity=unknown,
            percentage=float(state.get("percentage", unknown)),
            power_supply_status=charging,
            power_supply_health=0,
            power_supply_technology=0,
            present=True,
            cell_voltage=np.array([], np.float32),
            cell_temperature=np.array([], np.float32),
            location="",
            serial_number="",
        )
        yield self._made(f"{record.topic}_state", type, record.at, message)
