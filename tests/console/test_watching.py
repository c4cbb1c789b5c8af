"""Recordings watched on pages: where the robot was, what it saw and what happened, between any two moments."""

from __future__ import annotations

import json
import math
import struct
import zlib
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from roboglot.console.recordings import watching
from roboglot.console.recordings.excerpts import ROWS_MAX, SCANS_MAX, Excerpts
from roboglot.console.recordings.kept import RecordingFolder
from roboglot.console.recordings.pictures import last_picture
from roboglot.console.recordings.watching import Watching
from roboglot.media.h264 import H264Encoder
from roboglot.model.components.sensing.camera import Frame
from roboglot.model.components.system.fault import FaultLevel
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.geometry import ORIGIN, Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.sensing import LaserScan
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.entries import NANO, Entry
from roboglot.recording.files import Files, Limits, Origin
from roboglot.recording.reader import BadRecording
from roboglot.recording.redaction import Redaction
from tests.console.conftest import ServedConsole

FACTS = {"version": "1", "world": "office", "robots": '{"a": "universal", "b": "cyberdog2"}'}
SECONDS = 30
MOUNT = Pose(0.1, 0.0, math.pi)
GRID = OccupancyGrid(np.array([[-5, 0], [9, -3]], np.int8), 0.5, Point(-1.0, 2.0))


def exchange(operation: str, direction: Direction) -> Exchange:
    return Exchange(1.0, "a", "robomaster", "c", "127.0.0.1", direction, operation, b"ok;", status="ok")


def entries(second: int) -> list[Entry]:
    """Return what is recorded in one second: robot a drives 0.1 m, and robot b stands."""
    at = (1000 + second) * NANO
    frames = (
        ("a/map", "a/odom", Pose(1.0, 2.0, math.pi / 2)),
        ("a/odom", "a/base_link", Pose(second / 10, 0.0, 0.0)),
        ("a/base_link", "a/laser", MOUNT),
    )
    scan = LaserScan(float(second), np.array([1.0, np.inf, 2.5], np.float32), -1.0, 1.0, 0.1, 10.0, MOUNT)
    found = [
        Entry("/tf", "transforms", at, 0, frames),
        Entry("/tf", "transforms", at, 0, (("b/odom", "b/base_link", Pose(7.0, 7.0)),)),
        Entry("/a/scan", "scan", at, 0, ("a/laser", scan)),
        Entry("/a/slamware", "exchange", at, 0, exchange(f"GET {second}", Direction.REQUEST)),
        Entry("/a/robomaster", "exchange", at, 0, exchange("chassis push", Direction.PUSH)),
    ]
    action = {"id": 1, "name": "navigate_to", "status": "executing", "client": "me", "reason": "", "goal": None}
    match second:
        case 1:
            found.append(Entry("/a/map", "grid", at, 0, ("a/map", GRID)))
            found.append(Entry("/a/battery", "battery", at, 0, {"percentage": 0.5, "charging": True}))
        case 2 | 3 | 5:
            found.append(Entry("/a/actions", "action", at, 0, action))
        case 6:
            found.append(Entry("/a/actions", "action", at, 0, action | {"status": "aborted", "reason": "no path"}))
            found.append(Entry("/a/events", "event", at, 0, {"event": "PathBlocked", "stamp": 1.0, "at": {"x": 1}}))
            faults = [{"name": "lidar blocked", "level": FaultLevel.ERROR, "message": "dirt"}]
            found.append(Entry("/a/faults", "state", at, 0, {"faults": faults}))
        case 7:
            found.append(Entry("/marks", "mark", at, 0, {"text": "it turns"}))
    return found


def recorded(path: Path, limits: Limits | None = None) -> Excerpts:
    files = Files(path, Origin(FACTS), Redaction(), limits or Limits())
    files.open(1000 * NANO)
    for second in range(SECONDS + 1):
        for entry in entries(second):
            files.write(entry)
        files.flush()
    files.close()
    return Excerpts(path)


def unpacked(data: bytes) -> dict[str, list[tuple[float, dict[str, Any], bytes]]]:
    """Return the frames by kind: time, head, payload."""
    found: dict[str, list[tuple[float, dict[str, Any], bytes]]] = {}
    start = 0
    while start < len(data):
        size, at = struct.unpack_from("<Id", data, start)
        (head_size,) = struct.unpack_from("<H", data, start + 12)
        head = json.loads(data[start + 14 : start + 14 + head_size])
        payload = data[start + 14 + head_size : start + 12 + size]
        found.setdefault(head["kind"], []).append((at, head, payload))
        start += 12 + size
    return found


def rows_of(data: bytes) -> list[dict[str, Any]]:
    ((_, _, payload),) = unpacked(data)["rows"]
    rows: list[dict[str, Any]] = json.loads(payload)
    return rows


def moves_of(data: bytes) -> np.ndarray:
    ((_, _, payload),) = unpacked(data)["moves"]
    return np.frombuffer(payload, "<f4").reshape(-1, 4)


def test_robot_is_where_it_was_on_its_map(tmp_path: Path) -> None:
    excerpts = recorded(tmp_path / "r.mcap")
    assert (excerpts.seconds, excerpts.robots) == (SECONDS, ["a"])
    data = excerpts.read("a", 10.0, 2.0)
    assert moves_of(data) == pytest.approx(np.array([(t, 1.0, 2.0 + t / 10, math.pi / 2) for t in (10, 11, 12)]))
    found = unpacked(data)
    assert [at for at, *_ in found["scan"]] == [10.0, 11.0, 12.0]
    _, head, ranges = found["scan"][0]
    assert np.frombuffer(ranges, "<u2").tolist() == [1000, 65535, 2500]
    expected = Pose(1.0, 3.0, math.pi / 2).compose(MOUNT)
    assert head["pose"] == pytest.approx([expected.x, expected.y, expected.yaw], abs=1e-3)
    ((at, head, cells),) = found["map"]  # of the second before
    assert (at, head["width"], head["resolution"], head["origin"]) == (1.0, 2, 0.5, [-1.0, 2.0])
    assert list(zlib.decompress(cells)) == [1, 0, 2, 1]


def test_events_come_with_the_state_before(tmp_path: Path) -> None:
    data = recorded(tmp_path / "r.mcap").read("a", 4.0, 3.0)
    action = {"kind": "action", "id": 1, "name": "navigate_to", "client": "me"}
    assert [row for row in rows_of(data) if row["kind"] != "message"] == [
        {"at": 1.0, "kind": "battery", "charge": 0.5, "charging": True},
        action | {"at": 3.0, "status": "executing", "reason": ""},
        action | {"at": 6.0, "status": "aborted", "reason": "no path"},
        {"at": 6.0, "kind": "event", "name": "PathBlocked", "text": '{"at":{"x":1}}'},
        {"at": 6.0, "kind": "faults", "faults": [{"name": "lidar blocked", "level": "ERROR"}]},
        {"at": 7.0, "kind": "mark", "text": "it turns"},
    ]


def test_pushes_hide_no_request(tmp_path: Path) -> None:
    rows = rows_of(recorded(tmp_path / "r.mcap").read("a", 4.0, 3.0))
    asked = [(row["at"], row["operation"], row["text"]) for row in rows if row["kind"] == "message"]
    assert asked == [(float(second), f"GET {second}", "ok;") for second in (4, 5, 6, 7)]


def test_marks_are_found_in_all_parts(tmp_path: Path) -> None:
    excerpts = recorded(tmp_path / "r.mcap", Limits(part_seconds=5.0))
    assert len([*tmp_path.iterdir()]) > 3
    assert excerpts.marks() == [{"at": 7.0, "text": "it turns"}]
    assert [row[0] for row in moves_of(excerpts.read("a", 3.0, 4.0))] == [3.0, 4.0, 5.0, 6.0, 7.0]


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.floats(0.0, 40.0), st.floats(0.001, 90.0))
def test_excerpt_holds_exactly_its_seconds(tmp_path: Path, since: float, seconds: float) -> None:
    path = tmp_path / "r.mcap"
    excerpts = Excerpts(path) if path.exists() else recorded(path)
    data = excerpts.read("a", since, seconds)
    expected = [t for t in range(SECONDS + 1) if since - 1e-9 <= t <= since + seconds + 1e-9]
    assert [round(float(move[0])) for move in moves_of(data)] == expected
    assert [round(at) for at, *_ in unpacked(data).get("scan", [])] == expected


def test_long_excerpts_are_thinned_out(tmp_path: Path) -> None:
    files = Files(tmp_path / "r.mcap", Origin(FACTS), Redaction(), Limits())
    files.open(1000 * NANO)
    for number in range(3000):  # five minutes
        at = 1000 * NANO + number * NANO // 10
        files.write(Entry("/tf", "transforms", at, 0, (("a/odom", "a/base_link", ORIGIN),)))
        scan = LaserScan(0.0, np.ones(3, np.float32), 0.0, 1.0, 0.1, 10.0)
        files.write(Entry("/a/scan", "scan", at, 0, ("a/laser", scan)))
        files.write(Entry("/a/events", "event", at, 0, {"event": "Tick", "number": number}))
    files.close()
    data = Excerpts(tmp_path / "r.mcap").read("a", 0.0, 120.0)
    scans = [at for at, *_ in unpacked(data)["scan"]]
    assert SCANS_MAX - 1 <= len(scans) <= SCANS_MAX + 1
    assert max(np.diff(scans)) < 2.0  # s: evenly
    *ticks, left_out = rows_of(data)
    assert len(ticks) == ROWS_MAX
    assert (left_out["kind"], left_out["count"]) == ("left_out", 1201 - ROWS_MAX)


@pytest.mark.parametrize(
    ("topic", "kind", "value"),
    [
        ("/a/actions", "action", {"id": 1, "name": "x", "status": "y", "client": "", "reason": "", "goal": None}),
        ("/a/actions", "state", {"no": "action"}),
        ("/a/battery", "state", {"percentage": "much"}),
        ("/a/faults", "state", {"faults": 3}),
        ("/a/faults", "state", {"faults": [{"name": "dirt", "level": 77}]}),
        ("/a/events", "state", {}),
        ("/marks", "state", {}),
    ],
)
def test_strange_messages_are_named(tmp_path: Path, topic: str, kind: str, value: object) -> None:
    files = Files(tmp_path / "r.mcap", Origin(FACTS), Redaction(), Limits())
    files.open(1000 * NANO)
    files.write(Entry("/tf", "transforms", 1000 * NANO, 0, (("a/odom", "a/base_link", ORIGIN),)))
    files.write(Entry(topic, kind, 1000 * NANO, 0, value))
    files.close()
    if kind == "action":
        assert rows_of(Excerpts(tmp_path / "r.mcap").read("a", 0.0, 1.0))
        return
    with pytest.raises(BadRecording, match=r"r\.mcap has a message that cannot be read"):
        Excerpts(tmp_path / "r.mcap").read("a", 0.0, 1.0)


def filmed(path: Path, damaged: int = -1) -> Excerpts:
    """Record ten seconds of a camera at 4 Hz, each picture brighter than the one before; one may be damaged."""
    files, encoder = Files(path, Origin(FACTS), Redaction(), Limits()), H264Encoder(320, 180, 4.0)
    files.open(1000 * NANO)
    files.write(Entry("/tf", "transforms", 1000 * NANO, 0, (("a/odom", "a/base_link", ORIGIN),)))
    for number in range(8, 40):  # the camera begins after two seconds
        planes = np.full((270, 320), 128, np.uint8)
        planes[:180] = 20 + 5 * number
        data = encoder.encode(Frame(number / 4, planes)).data
        at = 1000 * NANO + number * NANO // 4
        files.write(Entry("/a/camera", "video", at, 0, ("a/camera", data[:30] if number == damaged else data)))
    files.close()
    return Excerpts(path)


def brightness(units: list[bytes]) -> float:
    """Return the mean brightness of the last picture as the camera had it, 16 to 235."""
    picture = Image.open(BytesIO(last_picture(units)))
    assert picture.size == (640, 360)
    return 16 + float(np.asarray(picture).mean()) * 219 / 255


@pytest.mark.parametrize("at", [2.0, 2.3, 4.9, 6.25, 9.75, 30.0])
def test_picture_is_that_of_its_moment(tmp_path: Path, at: float) -> None:
    excerpts = filmed(tmp_path / "r.mcap")
    assert excerpts.filmed == ["a"]
    if at > 15.0:
        assert excerpts.film("a", at) == []  # it had ended long before
        return
    assert brightness(excerpts.film("a", at)) == pytest.approx(20 + 5 * math.floor(at * 4), abs=3.0)


def test_damaged_picture_hides_only_itself(tmp_path: Path) -> None:
    excerpts = filmed(tmp_path / "r.mcap", damaged=22)
    assert brightness(excerpts.film("a", 5.5)) == pytest.approx(20 + 5 * 21, abs=8.0)
    assert brightness(excerpts.film("a", 6.0)) == pytest.approx(20 + 5 * 24, abs=3.0)


def test_moments_without_a_picture_are_named(tmp_path: Path) -> None:
    excerpts = filmed(tmp_path / "r.mcap")
    for robot, at in (("a", 1.9), ("b", 5.0)):
        with pytest.raises(NotFound, match="no picture of this moment"):
            last_picture(excerpts.film(robot, at))


async def test_few_recordings_are_kept_open(tmp_path: Path) -> None:
    for name in "abc":
        recorded(tmp_path / f"{name}.mcap")
    found = Watching(RecordingFolder(tmp_path), lambda: None)
    for name in "abcab":
        assert (await found.outline(f"{name}.mcap"))["seconds"] == SECONDS
    assert [file for file, *_ in found._open] == ["a.mcap", "b.mcap"]
    assert watching.OPEN_MAX == 2
    with pytest.raises(NotFound, match=r"there is no robot 'z' in a\.mcap"):
        await found.excerpt("a.mcap", "z", 0.0, 1.0)
    with pytest.raises(InvalidGoal, match="at most 120 s"):
        await found.excerpt("a.mcap", "a", 0.0, 121.0)


async def test_recording_of_this_program_is_watched(served: ServedConsole) -> None:
    _, begun = await served.ask("/api/recording", {"do": "start"})
    await served.clock.advance(2.0)
    await served.ask("/api/recording", {"do": "mark", "text": "here"})
    await served.clock.advance(2.0)
    assert (await served.ask(f"/api/recordings/{begun['file']}/watch"))[0] == 409  # it is being written
    await served.ask("/api/recording", {"do": "stop"})
    path = f"/api/recordings/{begun['file']}/watch"
    status, outline = await served.ask(path)
    assert (status, outline["robots"], [mark["text"] for mark in outline["marks"]]) == (200, ["a"], ["here"])
    assert outline["marks"][0]["at"] == pytest.approx(2.0, abs=0.2)
    moves = moves_of(await served.read(f"{path}/a/1000/2000"))
    assert len(moves) == pytest.approx(20, abs=2)
    refused = {"a/0/121000": 400, "a/x/1000": 400, "a/0/0": 400, "z/0/1000": 404, "a/0": 404, "a/0/camera.jpg": 404}
    for wrong, expected in refused.items():
        assert (await served.ask(f"{path}/{wrong}"))[0] == expected, wrong
