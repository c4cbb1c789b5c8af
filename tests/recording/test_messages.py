"""Contents of recordings: they come back byte for byte, except what must not be disclosed."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
import pytest
from foxglove_schemas_protobuf import FrameTransforms_pb2, LaserScan_pb2, PoseInFrame_pb2
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.geometry import Pose
from roboglot.model.sensing import LaserScan
from roboglot.model.tap import Direction, Exchange
from roboglot.recording import foxglove
from roboglot.recording.entries import Entry, encoded
from roboglot.recording.messages import decode_exchange, decode_input, encode_exchange, encode_plain
from roboglot.recording.reader import Record
from roboglot.recording.redaction import FIELDS, Redaction

if TYPE_CHECKING:
    from google.protobuf.timestamp_pb2 import Timestamp

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)
PAYLOADS = (
    st.binary(max_size=200)
    | st.text(max_size=200).map(str.encode)
    | VALUES.map(lambda value: json.dumps(value).encode())
    | VALUES.map(lambda value: b"POST /api/x\n\n" + json.dumps(value, indent=1).encode())
)


def exchange(payload: bytes) -> Exchange:
    return Exchange(
        1.5, "a", "slamware", "127.0.0.1:5", "slamware 127.0.0.1", Direction.REPLY, "GET /x", payload, "200"
    )


@given(PAYLOADS)
def test_every_payload_comes_back_byte_for_byte(payload: bytes) -> None:
    assert decode_exchange(encode_exchange(exchange(payload))) == exchange(payload)


def test_json_stands_in_the_file_as_json() -> None:
    kept = json.loads(encode_exchange(exchange(b'POST /x\n\n{"a": [1, 2.50]}')))
    assert kept["json"] == {"a": [1, 2.5]}
    assert kept["text"] == "POST /x\n\n"


SECRET = st.text(st.characters(codec="utf-8"), min_size=4, max_size=30)


@given(SECRET, st.sampled_from(["password", "wifi_password", "token", "SSID"]), st.integers(0, 2))
def test_secrets_are_redacted_however_deeply_they_are_quoted(secret: str, field: str, wrapped: int) -> None:
    secret = f"#{secret}"
    value = json.dumps({field: secret, "x": 1})
    for _ in range(wrapped):
        value = json.dumps({"params": value, "y": 2})
    redacted = Redaction()(value.encode()).decode()
    assert json.dumps(secret)[1:-1] not in redacted
    found = json.loads(redacted)
    for _ in range(wrapped):
        found = json.loads(found["params"])
    assert found == {field: "[redacted]", "x": 1}


@given(SECRET, st.booleans(), st.integers(0, 3))
def test_people_are_redacted_in_any_order_of_fields(name: str, mode_first: bool, wrapped: int) -> None:
    person = [("mode", "face"), ("x", 1), ("describe", f"#{name}")]
    found: Any = {"list": [{"mode": "tag", "describe": "#sign"}, dict(person if mode_first else reversed(person))]}
    for _ in range(wrapped):
        found = {"params": json.dumps(found)}
    found = json.loads(Redaction()(json.dumps(found).encode()))
    for _ in range(wrapped):
        found = json.loads(found["params"])
    assert found == {"list": [{"mode": "tag", "describe": "#sign"}, dict(person) | {"describe": "[redacted]"}]}


@pytest.mark.parametrize("part", ['"describe":"a",', '"mode":"face",', '"describe"', "token", "\\\\"])
def test_no_message_takes_long(part: str) -> None:
    """The first two took minutes, of the whole process: no thread runs beside a regular expression."""
    Redaction()(b'{"describe token' + part.encode() * 20_000)


def test_only_secrets_in_queries_and_numbers_are_redacted() -> None:
    redact = Redaction(("token", "pin"))
    assert redact(b"GET /x?token=abc&y=2\n\n") == b"GET /x?token=[redacted]&y=2\n\n"
    assert redact(b'{"pin": 1234, "pinned": true}') == b'{"pin": "[redacted]", "pinned": true}'
    assert redact(b"chassis move x 1;") == b"chassis move x 1;"


def test_values_of_the_model_become_json() -> None:
    value = {"a": float("inf"), "b": b"xx", "c": (1, {2}), "d": Direction.PUSH}
    assert json.loads(encode_plain(value)) == {"a": "inf", "b": {"bytes": 2}, "c": [1, [2]], "d": "push"}


@given(st.binary(max_size=200), st.sampled_from(FIELDS), st.booleans())
def test_every_field_is_found(around: bytes, field: str, upper: bool) -> None:
    name = field.upper() if upper else field
    said = around + b' {"%s": "Xanthippe"}' % name.encode()
    assert Redaction()(said).endswith(b'[redacted]"}')


def test_refusals_do_not_quote_names() -> None:
    refused = exchange(b'{"result": 5910}')._replace(
        door="driver/cyberdog", operation="7001", refusal="no face of 'Xanthippe' is known"
    )
    assert Redaction().exchange(refused).refusal == "no face of [redacted] is known"
    assert Redaction().exchange(refused._replace(operation="6004")).refusal == refused.refusal


def test_refusals_do_not_quote_networks() -> None:
    body = b'{"error": "there is no network \'HomeNet\' here"}'
    refused = exchange(body)._replace(
        operation="PUT /api/core/system/v1/network/status", refusal="there is no network 'HomeNet' here"
    )
    found = Redaction().exchange(refused)
    assert (found.payload, found.refusal) == (
        b'{"error": "there is no network [redacted] here"}',
        "there is no network [redacted] here",
    )


@pytest.mark.parametrize("name", ["join network", "join a network"])
def test_actions_do_not_name_networks(name: str) -> None:
    state = {"name": name, "goal": "HomeNet", "reason": "HomeNet refuses this password", "status": "aborted"}
    data = encoded(Entry("/a/actions", "action", 0, 0, state), Redaction())
    assert b"HomeNet" not in data
    assert b"[redacted] refuses this password" in data


# Poses, transforms and scans whose bytes are put together by hand are those of the protobuf library.
TIMES = st.integers(0, 4_000_000_000 * 10**9) | st.just(1_700_000_000 * 10**9)
NUMBERS = st.floats() | st.sampled_from([0.0, -0.0])
POSES = st.builds(Pose, NUMBERS, NUMBERS, st.floats(-4, 4) | st.sampled_from([0.0, -0.0, math.pi]))
NAMES = st.text(max_size=200)


def stamp(message: Timestamp, at: int) -> None:
    message.seconds, message.nanos = divmod(at, 10**9)


@given(TIMES, NAMES, POSES)
def test_poses_are_the_librarys(at: int, frame: str, pose: Pose) -> None:
    message = PoseInFrame_pb2.PoseInFrame(frame_id=frame)
    stamp(message.timestamp, at)
    place = message.pose
    place.position.x, place.position.y, place.position.z = pose.x, pose.y, 0.0
    place.orientation.z, place.orientation.w = math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)
    assert foxglove.encode_pose(at, (frame, pose)) == message.SerializeToString()


@given(TIMES, st.lists(st.tuples(NAMES, NAMES, POSES), max_size=4).map(tuple))
def test_transforms_are_the_librarys(at: int, value: tuple[tuple[str, str, Pose], ...]) -> None:
    message = FrameTransforms_pb2.FrameTransforms()
    for parent, child, pose in value:
        transform = message.transforms.add(parent_frame_id=parent, child_frame_id=child)
        stamp(transform.timestamp, at)
        transform.translation.x, transform.translation.y = pose.x, pose.y
        transform.rotation.z, transform.rotation.w = math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)
    assert foxglove.encode_transforms(at, value) == message.SerializeToString()


@given(TIMES, NAMES, st.lists(st.floats(width=32), min_size=1, max_size=400), NUMBERS, st.floats(-4, 4))
def test_scans_are_the_librarys(at: int, frame: str, ranges: list[float], start: float, step: float) -> None:
    scan = LaserScan(0.0, np.array(ranges, np.float32), start, step, 0.1, 30.0)
    with np.errstate(over="ignore"):
        rounded = np.round(scan.ranges * 1024.0).astype(np.float64) / 1024.0
        found = foxglove.encode_scan(at, (frame, scan))
    message = LaserScan_pb2.LaserScan(
        frame_id=frame, start_angle=start, end_angle=start + step * (len(ranges) - 1), ranges=rounded
    )
    message.pose.orientation.w = 1.0
    stamp(message.timestamp, at)
    assert found == message.SerializeToString()


@pytest.mark.parametrize("data", [b"", b"[]", b"3", b'"\xff"', b"[" * 100_000, b'{"a": ' * 100_000])
def test_messages_are_objects(data: bytes) -> None:
    def parsed(data: bytes) -> object:
        return Record("/a/inputs", "roboglot.Input", 0, data).json()

    for read in (decode_exchange, decode_input, parsed):
        with pytest.raises((msgspec.DecodeError, UnicodeDecodeError)):
            read(data)
