"""Excerpts of a recording for pages: where a robot was, what its lidar saw, its map, and what happened.

An excerpt holds what a page shows between two moments, thinned out, and the map, charge, faults and action before it.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Callable, Sequence
from itertools import islice
from pathlib import Path

import msgspec
import numpy as np
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Grid_pb2 import Grid
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan as ScanMessage
from google.protobuf.message import DecodeError

from roboglot.console.frames import framed, map_frame, scan_frame
from roboglot.console.wire_log import readable
from roboglot.model.components.system.fault import FaultLevel
from roboglot.model.geometry import ORIGIN, Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.sensing import LaserScan
from roboglot.model.tap import Direction
from roboglot.recording.message_index import MessageIndex, TimedMessage
from roboglot.recording.messages import decode_exchange
from roboglot.recording.reader import BadRecording
from roboglot.validation import decode_json

SCANS_MAX, MAPS_MAX, MOVES_MAX = 100, 12, 1200  # of one excerpt
ROWS_MAX = 1000  # of one excerpt, and of each kind
FAULTS_MAX = 100  # of one row
MARKS_MAX = 500
TEXT_MAX = 200  # characters of a row's text
NANO = 1e9
FILM_SECONDS = 5.0
KEY_PICTURE = re.compile(rb"\x00\x00\x01[\x25\x45\x65]")  # a slice of an IDR picture
STATES = "map", "battery", "faults", "actions"  # topics whose last message holds at a moment
DAMAGE = DecodeError, ValueError, KeyError, TypeError, AttributeError, OverflowError
_head = struct.Struct("<Id").pack  # bytes of a frame, and its time


class Excerpts:
    """Reader of one recording. Methods read files: call them in a thread, one at a time."""

    def __init__(self, path: Path) -> None:
        """Raises BadRecording, OSError."""
        self._path, self._index = path, MessageIndex(path)
        self._names = [topic.name for topic in self._index.topics]
        self._exchanges = {i for i, topic in enumerate(self._index.topics) if topic.schema == "roboglot.Exchange"}

    @property
    def seconds(self) -> float:
        """Length in robot time, s."""
        return (self._index.end - self._index.first) / NANO

    @property
    def robots(self) -> Sequence[str]:
        """Names of the robots in it, sorted."""
        return sorted({name.split("/")[1] for name in self._names if name.count("/") > 1} - {"truth"})

    def marks(self) -> list[dict[str, object]]:
        """Return the first ``MARKS_MAX`` marks, with ``at`` in s since the beginning. Raises BadRecording, OSError."""
        wanted = {place for place, name in enumerate(self._names) if name == "/marks"}
        found = islice(self._index.only(wanted), MARKS_MAX)
        return [{"at": self._since(mark.at), "text": self._text_of(mark)} for mark in found]

    @property
    def filmed(self) -> Sequence[str]:
        """Names of the robots whose camera is in it, sorted."""
        return sorted(name.split("/")[1] for name in self._names if name.endswith("/camera") and name.count("/") == 2)

    def film(self, robot: str, at: float) -> list[bytes]:
        """Return the access units (H.264, Annex B) of a camera up to a moment (s since the beginning).

        They begin with the last key picture of the ``FILM_SECONDS`` before it; empty without one. Raises BadRecording,
        OSError.
        """
        last = self._index.first + round(at * NANO)
        wanted = {place for place, name in enumerate(self._names) if name == f"/{robot}/camera"}
        units: list[bytes] = []
        for batch in self._index.play(max(self._index.first, last - round(FILM_SECONDS * NANO))):
            if batch[0].at > last:
                break
            for message in batch:
                if message.topic in wanted and message.at <= last:
                    unit = self._unit(message.data)
                    if KEY_PICTURE.search(unit):
                        units.clear()
                    elif not units:
                        continue
                    units.append(unit)
        return units

    def _unit(self, data: bytes) -> bytes:
        try:
            return bytes(CompressedVideo.FromString(data).data)
        except DecodeError as error:
            raise BadRecording(f"{self._path.name} has a picture that cannot be read: {error}") from None

    def read(self, robot: str, since: float, seconds: float) -> bytes:
        """Return the frames of a robot from ``since`` on (s since the beginning).

        Each is preceded by its length (u32) and its time (f64, s since the beginning), little endian. Kinds: ``map``
        and ``scan`` as in ``console/frames.py``; ``moves`` (rows of four f32: time, x, y, yaw in the map); ``rows``
        (JSON). Raises BadRecording, OSError.
        """
        first = self._index.first + round(since * NANO)
        last = first + round(seconds * NANO)
        excerpt = _Excerpt(robot, seconds)
        handlers = {
            place: handler
            for place, name in enumerate(self._names)
            if (handler := excerpt.handler(name, is_exchange=place in self._exchanges)) is not None
        }
        states = {place for place in handlers if self._names[place] in {f"/{robot}/{word}" for word in STATES}}
        try:
            for message in self._index.last(first - 1, states):
                handlers[message.topic](self._since(message.at), message.data)
            for batch in self._index.play(first):
                if batch[0].at > last:
                    break
                for message in batch:
                    if message.at <= last and (handler := handlers.get(message.topic)) is not None:
                        handler(self._since(message.at), message.data)
        except BadRecording:
            raise
        except DAMAGE as error:
            raise BadRecording(f"{self._path.name} has a message that cannot be read: {error}") from None
        return excerpt.packed()

    def _since(self, at: int) -> float:
        """Return a time in s since the beginning."""
        return (at - self._index.first) / NANO

    def _text_of(self, mark: TimedMessage) -> str:
        try:
            return decode_json(mark.data, _Mark).text[:TEXT_MAX]
        except DAMAGE as error:
            raise BadRecording(f"{self._path.name} has a mark that cannot be read: {error}") from None


Handler = Callable[[float, bytes], None]  # of a message: its time (s since the beginning) and its bytes


class _Mark(msgspec.Struct):
    text: str


class _Action(msgspec.Struct):
    id: int
    name: str
    status: str
    client: str
    reason: str


class _Battery(msgspec.Struct):
    percentage: float
    charging: bool


class _Fault(msgspec.Struct):
    name: str
    level: int


class _Faults(msgspec.Struct):
    faults: list[_Fault]


class _Excerpt:
    """Excerpt of one robot's messages so far; ``seconds``: its length."""

    def __init__(self, robot: str, seconds: float) -> None:
        self._robot = robot
        self._frames: list[tuple[float, bytes]] = []
        self._moves: list[tuple[float, float, float, float]] = []
        self._rows: list[dict[str, object]] = []
        self._count: dict[str, int] = {}  # of rows, by kind
        self._doing: dict[int, str] = {}  # last status of each action
        self._base, self._mount, self._placed = ORIGIN, ORIGIN, False
        self._every = {"scan": seconds / SCANS_MAX, "map": seconds / MAPS_MAX, "move": seconds / MOVES_MAX}
        self._next = dict.fromkeys(self._every, -math.inf)

    def handler(self, topic: str, *, is_exchange: bool) -> Handler | None:
        """Return what takes the messages of a topic; None if they do not count."""
        if topic in ("/tf", "/marks"):
            return {"/tf": self._take_place, "/marks": self._take_mark}[topic]
        _, robot, *rest = topic.split("/") if topic.count("/") == 2 else ("", "", "")
        if robot != self._robot:
            return None
        if is_exchange:
            return self._take_exchange
        taken: dict[str, Handler] = {
            "scan": self._take_scan,
            "map": self._take_map,
            "actions": self._take_action,
            "events": self._take_event,
            "battery": self._take_battery,
            "faults": self._take_faults,
        }
        return taken.get(rest[0])

    def packed(self) -> bytes:
        """Return all frames; the last row counts those that were left out, if any."""
        moves = np.array(self._moves, "<f4").tobytes()
        if more_rows := sum(max(0, count - ROWS_MAX) for count in self._count.values()):
            self._rows.append({"at": self._rows[-1]["at"], "kind": "left_out", "count": more_rows})
        rows = msgspec.json.encode(self._rows)
        more = [framed({"kind": "moves", "robot": self._robot}, moves), framed({"kind": "rows"}, rows)]
        return b"".join(_head(len(frame), at) + frame for at, frame in [*self._frames, *((0.0, one) for one in more)])

    def _is_due(self, kind: str, at: float) -> bool:
        """Return whether one more of a kind is wanted at a time; if so, it counts as taken."""
        every = self._every[kind]
        if at < self._next[kind] - every / 2:  # they do not come at exactly even times
            return False
        self._next[kind] = max(self._next[kind], at) + every
        return True

    # -- places --

    def _take_place(self, at: float, data: bytes) -> None:
        origin, base = ORIGIN, None
        for one in FrameTransforms.FromString(data).transforms:
            owner, _, child = one.child_frame_id.rpartition("/")
            if owner != self._robot:
                continue
            way, turn = one.translation, one.rotation
            pose = Pose(way.x, way.y, 2.0 * math.atan2(turn.z, turn.w))
            match child:
                case "odom":
                    origin = pose
                case "base_link":
                    base = pose
                case "laser":
                    self._mount = pose
        if base is not None:
            self._base, self._placed = origin.compose(base), True
            if self._is_due("move", at):
                self._moves.append((at, self._base.x, self._base.y, self._base.yaw))

    def _take_scan(self, at: float, data: bytes) -> None:
        if not self._placed or not self._is_due("scan", at):
            return
        message = ScanMessage.FromString(data)
        ranges = np.array(message.ranges, np.float32)
        step = (message.end_angle - message.start_angle) / max(1, len(ranges) - 1)
        scan = LaserScan(at, ranges, message.start_angle, step, 0.0, math.inf, self._mount)
        self._frames.append((at, scan_frame(self._robot, scan, self._base)))

    def _take_map(self, at: float, data: bytes) -> None:
        if not self._is_due("map", at):
            return
        message = Grid.FromString(data)
        cells = np.frombuffer(message.data, np.int8).reshape(-1, message.column_count)
        evidence = np.where(cells < 0, 0, np.where(cells > 50, 1, -1)).astype(np.int8)
        corner = Point(message.pose.position.x, message.pose.position.y)
        self._frames.append(
            (at, map_frame(self._robot, round(at * 1e3), OccupancyGrid(evidence, message.cell_size.x, corner)))
        )

    # -- what happened --

    def _add(self, kind: str, at: float, **values: object) -> None:
        self._count[kind] = self._count.get(kind, 0) + 1
        if self._count[kind] <= ROWS_MAX:
            self._rows.append({"at": round(at, 3), "kind": kind, **values})

    def _take_mark(self, at: float, data: bytes) -> None:
        self._add("mark", at, text=decode_json(data, _Mark).text[:TEXT_MAX])

    def _take_action(self, at: float, data: bytes) -> None:
        action = decode_json(data, _Action)
        if self._doing.get(action.id) != action.status:
            self._doing[action.id] = action.status
            words = {word: text[:TEXT_MAX] for word, text in msgspec.structs.asdict(action).items() if word != "id"}
            self._add("action", at, id=action.id, **words)

    def _take_event(self, at: float, data: bytes) -> None:
        event = decode_json(data, dict[str, object])
        rest = {key: value for key, value in event.items() if key not in ("event", "stamp", "action")}
        text = msgspec.json.encode(rest).decode() if rest else ""
        self._add("event", at, name=str(event["event"])[:TEXT_MAX], text=text[:TEXT_MAX])

    def _take_battery(self, at: float, data: bytes) -> None:
        battery = decode_json(data, _Battery)
        self._add("battery", at, charge=battery.percentage, charging=battery.charging)

    def _take_faults(self, at: float, data: bytes) -> None:
        faults = decode_json(data, _Faults).faults[:FAULTS_MAX]
        self._add("faults", at, faults=[{"name": one.name[:TEXT_MAX], "level": _level(one)} for one in faults])

    def _take_exchange(self, at: float, data: bytes) -> None:
        one = decode_exchange(data)
        if one.direction is Direction.PUSH:  # many times a second, they would hide the rest
            return
        self._add(
            "message",
            at,
            door=one.door,
            direction=str(one.direction),
            operation=one.operation[:TEXT_MAX],
            status=one.status[:TEXT_MAX],
            refusal=one.refusal[:TEXT_MAX],
            text=readable(one.payload[: 4 * TEXT_MAX])[:TEXT_MAX],
        )


def _level(fault: _Fault) -> str:
    return FaultLevel(fault.level).name
