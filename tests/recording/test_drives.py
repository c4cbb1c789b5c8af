"""Comparison of what two robots did: their ways and actions, from recordings as the console makes them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from roboglot.model.events import FloorReached
from roboglot.model.geometry import Pose
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.comparing import reports
from roboglot.recording.comparing.comparison import Comparison
from roboglot.recording.comparing.drives import ODOMETRY, POSES, TRUTH, Drive, Track, compare_drives, read_drive
from roboglot.recording.comparing.masks import STRICT, Mask
from roboglot.recording.comparing.recordings import compare_recordings
from roboglot.recording.entries import NANO, Entry
from roboglot.recording.files import Files, Limits, Origin
from roboglot.recording.messages import plain
from roboglot.recording.reader import BadRecording
from roboglot.recording.redaction import Redaction

SECONDS = 20.0
Way = Callable[[float], Pose]


def straight(late: float = 0.0, speed: float = 0.5, way: float = 2.0, turn: float = 0.0) -> Way:
    """Return a drive straight on, at an angle; ``late``: s until it begins."""

    def at(time: float) -> Pose:
        gone = min(max(time - late, 0.0) * speed, way)
        return Pose(gone * math.cos(turn), gone * math.sin(turn), turn)

    return at


def track(way: Way, since: float = 0.0, until: float = SECONDS) -> Track:
    return Track([(1e9 + n / 10, way(n / 10)) for n in range(round(since * 10), round(until * 10))])


def compared(one: Way, other: Way, mask: Mask | None = None) -> Comparison:
    outcome = compare_drives(
        Drive({TRUTH: track(one)}), Drive({TRUTH: track(other)}), mask or Mask(), ("one.mcap", "two.mcap")
    )
    return Comparison([], outcome.rows, outcome.figures, outcome.reason)


def record(
    path: Path, places: Mapping[str, Way], *actions: tuple[str, str], stray: tuple[str, float, Pose] | None = None
) -> Path:
    """Write a recording as the console makes one: the door's own pushes, places and actions; ``stray``: one more."""
    files = Files(path, Origin({"version": "1"}), Redaction(), Limits())
    files.open(NANO)

    def put(topic: str, kind: str, seconds: float, value: object) -> None:
        files.write(Entry(topic, kind, round((1e9 + seconds) * NANO), 0, value))

    for number, (name, status) in enumerate(actions):
        for seconds, now in ((0.5, "executing"), (0.9, status)):
            action = {"id": number, "name": name, "status": now, "reason": "", "goal": None, "feedback": None}
            put("/a/actions", "action", number + seconds, action)
    for second in range(5):
        push = Exchange(float(second), "a", "robomaster", "x", "", Direction.PUSH, "> robot ip", b"robot ip 127.0.0.1")
        put("/a/robomaster", "exchange", second, push)
    for topic, way in places.items():
        for number in range(round(SECONDS * 10)):
            value: object = ("world", way(number / 10))
            if topic == "/tf":
                value = (("a/odom", "a/base_link", way(number / 10)), ("b/odom", "b/base_link", Pose(9.0, 9.0, 0.0)))
            put(topic, "transforms" if topic == "/tf" else "pose", number / 10, value)
    if stray is not None:
        put(stray[0], "pose", stray[1], ("world", stray[2]))
    files.close()
    return path


def test_equal_messages_hide_no_other_drive(tmp_path: Path) -> None:
    """Two drives from the console: the doors' messages are the same, the ways are not."""
    one = record(tmp_path / "1.mcap", {"/truth/a/pose": straight()}, ("navigate to", "succeeded"))
    other = record(tmp_path / "2.mcap", {"/truth/a/pose": straight(turn=0.8)}, ("navigate to", "succeeded"))
    comparison = compare_recordings(one, other, Mask())
    assert (comparison.messages, comparison.of("robomaster").fidelity) == (1.0, 1.0)
    assert comparison.fidelity < 0.2
    text = reports.table(comparison)
    assert re.search(r"^drive: .*ground truth: at most 1\.5\d m apart in 4\.\d s of motion, 2\.00 and", text, re.M)
    assert "last place: 2.00, 0.00 at 0° | 1.39, 1.43 at 46°" in text
    assert "ground truth: at most" in reports.page(comparison, ("1", "2"))
    failed = [case.get("name") for case in ET.fromstring(reports.junit(comparison)).iter("testcase") if len(case)]
    assert failed == ["places (ground truth)"]


def test_recording_agrees_with_itself_exactly(tmp_path: Path) -> None:
    path = record(tmp_path / "1.mcap", {"/truth/a/pose": straight(1.0, 0.3), "/tf": straight()}, ("turn", "failed"))
    comparison = compare_recordings(path, path, STRICT)
    assert not comparison.differs
    assert [row.checks > 1 for row in comparison.drive] == [True, False]
    assert comparison.reason == ""


@pytest.mark.parametrize(("topic", "source"), [("/a/pose", POSES), ("/tf", ODOMETRY)])
def test_real_robots_are_compared_by_what_they_estimate(tmp_path: Path, topic: str, source: str) -> None:
    one, other = (record(tmp_path / f"{n}.mcap", {topic: straight(way=n)}) for n in (1, 2))
    comparison = compare_recordings(one, other, Mask())
    assert comparison.figures.startswith(source)
    assert comparison.fidelity < 1.0


@pytest.mark.parametrize(
    ("seconds", "place", "why"),
    [
        (4e9, Pose(0.0, 0.0, 0.0), r"ground truth are 46296 days apart \(at most 7\): one of their times is wrong"),
        (-5e8, Pose(0.0, 0.0, 0.0), "one of their times is wrong"),
        (1.0, Pose(math.nan, 0.0, 0.0), "a place is not finite"),
        (1.0, Pose(0.0, math.inf, 0.0), "a place is not finite"),
    ],
)
def test_damaged_place_or_time_is_named(tmp_path: Path, seconds: float, place: Pose, why: str) -> None:
    topic = "/truth/a/pose"
    one = record(tmp_path / "1.mcap", {topic: straight()})
    other = record(tmp_path / "2.mcap", {topic: straight()}, stray=(topic, seconds, place))
    with pytest.raises(BadRecording, match=why):
        compare_recordings(one, other, Mask())


def test_recording_without_places_says_so(tmp_path: Path) -> None:
    one, other = record(tmp_path / "1.mcap", {}), record(tmp_path / "2.mcap", {"/a/pose": straight()})
    comparison = compare_recordings(one, other, Mask())
    said = f"only messages were compared, not where the robots were: no places are in {one}"
    assert said in reports.table(comparison)
    assert said in reports.page(comparison, ("1", "2"))
    assert b'<skipped message="no places are in' in reports.junit(comparison)


def test_one_protocol_alone_leaves_the_drive_out(tmp_path: Path) -> None:
    one, other = (record(tmp_path / f"{n}.mcap", {"/a/pose": straight(way=n)}) for n in (1, 2))
    comparison = compare_recordings(one, other, Mask(), door="robomaster")
    assert (comparison.fidelity, comparison.drive) == (1.0, [])
    assert "only messages were compared" in reports.table(comparison)


def test_robots_without_messages_are_counted_too(tmp_path: Path) -> None:
    path = record(tmp_path / "1.mcap", {"/a/pose": straight(), "/b/pose": straight()})
    with pytest.raises(BadRecording, match="robots a, b: choose one"):
        compare_recordings(path, path, Mask())
    comparison = compare_recordings(path, path, Mask(), "b")
    assert "no messages were compared" in reports.table(comparison)
    assert not comparison.differs
    with pytest.raises(BadRecording, match="nothing of that robot"):
        compare_recordings(path, path, Mask(), "c")


def test_actions_are_paired_in_order(tmp_path: Path) -> None:
    drive, turn = ("move", "succeeded"), ("turn", "succeeded")
    one = record(tmp_path / "1.mcap", {"/a/pose": straight()}, drive, turn)
    other = record(tmp_path / "2.mcap", {"/a/pose": straight()}, ("sit", "succeeded"), drive, ("turn", "failed"))
    row = compare_recordings(one, other, Mask()).drive[1]
    assert (row.checks, row.agreed) == (3, 1)
    assert [(d.what, d.one, d.other) for d in row.differences] == [
        ("action 1", "(not there)", "sit succeeded"),
        ("action 2", "turn succeeded", "turn failed"),
    ]


def test_floors_are_paired_in_order() -> None:
    places = {TRUTH: track(straight())}
    outcome = compare_drives(Drive(places, floors=[1, 0]), Drive(places, floors=[2, 0]), Mask(), ("one", "other"))
    row = next(row for row in outcome.rows if row.operation == "floors")
    assert (row.checks, row.agreed) == (2, 1)
    assert [(d.what, d.one, d.other) for d in row.differences] == [("floor 1", "1", "2")]


def test_floors_are_read_from_events(tmp_path: Path) -> None:
    files = Files(tmp_path / "a.mcap", Origin({"version": "1"}), Redaction(), Limits())
    files.open(NANO)
    for at, floor in enumerate((1, 0)):
        reached = plain(FloorReached(stamp=float(at), floor=floor, place=Pose())) | {"event": "FloorReached"}
        files.write(Entry("/a/events", "event", (1000 + at) * NANO, 0, reached))
    files.close()
    assert read_drive(tmp_path / "a.mcap", "a").floors == [1, 0]


def test_waiting_before_the_drive_does_not_count() -> None:
    assert not compared(straight(late=1.0), straight(late=7.0)).differs


def test_time_of_standing_does_not_hide_a_detour() -> None:
    def detour(time: float) -> Pose:
        return Pose(0.5 * math.sin(min(time, 2.0) * math.pi), 0.0, 0.0)

    assert compared(detour, lambda _time: Pose()).fidelity < 0.4


def test_slower_drive_on_the_same_way_differs() -> None:
    comparison = compared(straight(speed=0.5), straight(speed=0.25))
    assert 0.0 < comparison.fidelity < 0.8
    assert all("last place" not in difference.what for difference in comparison.drive[0].differences)


def test_drive_that_ended_early_differs_at_its_end() -> None:
    (row,) = compared(straight(), straight(way=1.5)).drive
    assert "last place: 2.00, 0.00 at 0° | 1.50, 0.00 at 0°" in reports.table(Comparison([row]))


@pytest.mark.parametrize("speed", [0.1, 0.5, 1.0])
def test_small_errors_are_no_difference(speed: float) -> None:
    way = straight(1.0, speed, 2.0, 0.7)

    def noisy(time: float) -> Pose:
        place, shift = way(time), 0.02 * math.sin(9.0 * time)
        return Pose(place.x + shift, place.y - shift, place.yaw + shift)

    assert not compared(way, noisy).differs
