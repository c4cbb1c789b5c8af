"""Recorded drives in the formats of robots and research: the same drive written in each reads as the same drive."""

from __future__ import annotations

import gzip
import math
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roboglot.datasets.drive_log import BadDriveLog, DriveLog
from roboglot.datasets.formats import read_drive_log
from roboglot.model.geometry import Pose

POSES = [Pose(0.1 * k, 0.02 * k, 0.05 * k) for k in range(12)]
ANGLES = np.radians(np.arange(-90, 91))


def ranges_at(number: int) -> list[float]:
    """1 to 3 m with a gap where the scanner saw nothing."""
    ranges = 2.0 + np.sin(ANGLES * 3 + number)
    ranges[40:44] = 81.91
    return [round(float(value), 3) for value in ranges]


def carmen(path: Path, offset: float = 0.1) -> Path:
    lines = ["# CARMEN Logfile", "PARAM robot_frontlaser_offset 0.1"]
    for number, pose in enumerate(POSES):
        laser = pose.compose(Pose(offset))
        words = [*ranges_at(number), laser.x, laser.y, laser.yaw, pose.x, pose.y, pose.yaw, 100 + number]
        lines.append(f"FLASER 181 {' '.join(map(str, words))} host {number}")
        lines.append("SONAR 0 0 0")
    path.write_text("\n".join([*lines, "FLASER 181 1.0 broken"]))
    return path


def robotlaser(path: Path) -> Path:
    lines = []
    for number, pose in enumerate(POSES):
        laser = pose.compose(Pose(0.1))
        poses = [laser.x, laser.y, laser.yaw, pose.x, pose.y, pose.yaw]
        head = ["ROBOTLASER1", 0, -math.pi / 2, math.pi, math.radians(1), 80, 0.01, 0, 181]
        tail = [0, *poses, 0, 0, 0, 0, 0, 100 + number, "host", number]
        lines.append(" ".join(map(str, [*head, *ranges_at(number), *tail])))
    path.write_text("\n".join(lines))
    return path


def columns(path: Path) -> Path:
    rows = [[100 + k, p.x, p.y, p.yaw, p.x, p.y, p.yaw, *ranges_at(k)] for k, p in enumerate(POSES)]
    path.write_text("# stamp, odometry, reference, ranges\n" + "\n".join(" ".join(map(str, row)) for row in rows))
    return path


def _object(name: str, version: int, body: bytes, old: bool) -> bytes:
    if old:
        return struct.pack("<I", len(name)) + name.encode() + struct.pack("<I", version) + body
    return bytes([0x80 | len(name)]) + name.encode() + bytes([version]) + body + b"\x88"


def rawlog(path: Path, old: bool = False) -> Path:
    """Scans with the way since the one before; among them an image that only looks like objects."""
    data, before = b"", POSES[0]
    for number, pose in enumerate(POSES):
        step, before = pose.relative_to(before), pose
        mean = _object("CPose2D", 1, struct.pack("<3d", step.x, step.y, step.yaw), old)
        data += _object("CActionRobotMovement2D", 4, struct.pack("<I", 0) + mean + bytes(60), old)
        data += _object("CObservationImage", 3, b"\x97C CObservation2DRange \x88" * 9, old)
        turned = struct.pack("<12d", 0.1, 0, 0.3, 1, 0, 0, 0, 1, 0, 0, 0, 1)
        mount = _object("CPose3D", 3, turned, old)
        ranges = np.array(ranges_at(number), "<f4")
        body = struct.pack("<fBf", math.pi, 1, 80.0) + mount + struct.pack("<I", 181) + ranges.tobytes()
        body += (ranges < 80).astype("u1").tobytes() + struct.pack(
            "<fQf", 0.01, (100 + number + 11_644_473_600) * 10**7, 0.1
        )
        body += struct.pack("<I5sf", 5, b"LASER", 0.0)
        data += _object("CObservation2DRangeScan", 6, body, old)
    path.write_bytes(data if old else gzip.compress(data))
    return path


def check(recording: DriveLog, mount: float) -> None:
    assert len(recording.scans) == len(POSES)
    for number, (recorded, pose) in enumerate(zip(recording.scans, POSES, strict=True)):
        scan = recorded.scan
        start = recording.scans[0].odometry
        assert recorded.odometry.relative_to(start).distance_to(pose.relative_to(POSES[0])) < 1e-6
        assert scan.stamp == pytest.approx(100 + number)
        assert scan.angles == pytest.approx(ANGLES, abs=1e-6)
        assert np.isinf(scan.ranges[40:44]).all()  # nothing within range, as opposed to not measured
        seen = np.isfinite(scan.ranges)
        assert seen.sum() == 177
        assert scan.ranges[seen] == pytest.approx(np.array(ranges_at(number))[seen], abs=1e-5)
        assert scan.mount.x == pytest.approx(mount, abs=1e-6)


@pytest.mark.parametrize("write", [carmen, robotlaser, rawlog])
def test_each_format_gives_the_same_drive(tmp_path: Path, write) -> None:
    check(read_drive_log(write(tmp_path / "drive")), 0.1)


def test_rawlogs_of_the_first_years_are_read(tmp_path: Path) -> None:
    check(read_drive_log(rawlog(tmp_path / "drive.rawlog", old=True)), 0.1)


@pytest.mark.parametrize("piece", [100, 997, 4096])
def test_rawlogs_are_read_piece_by_piece(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, piece: int) -> None:
    monkeypatch.setattr("roboglot.datasets.rawlog.PIECE", piece)
    monkeypatch.setattr("roboglot.datasets.rawlog.OBJECT_MAX", 2000)
    check(read_drive_log(rawlog(tmp_path / "drive.rawlog")), 0.1)


def test_packed_zeros_take_no_memory(tmp_path: Path) -> None:
    file = tmp_path / "drive.rawlog"
    file.write_bytes(gzip.compress(bytes(16 << 20)) * 4)
    tracemalloc.start()
    with pytest.raises(BadDriveLog, match="no readable"):
        read_drive_log(file)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 40 << 20


@pytest.mark.parametrize(("limit", "value"), [("READINGS_MAX", 500), ("SCANS_MAX", 3), ("FILE_BYTES_MAX", 900)])
def test_rawlogs_that_unpack_too_long_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: str, value: int
) -> None:
    monkeypatch.setattr(f"roboglot.datasets.rawlog.{limit}", value)
    with pytest.raises(BadDriveLog, match=f"more than .*{value}"):
        read_drive_log(rawlog(tmp_path / "drive.rawlog"))


def test_tables_may_hold_a_reference(tmp_path: Path) -> None:
    recording = read_drive_log(columns(tmp_path / "drive.txt"))
    check(recording, 0.0)
    assert [item.reference for item in recording.scans] == POSES


def test_unread_lines_are_counted(tmp_path: Path) -> None:
    assert read_drive_log(carmen(tmp_path / "drive.log")).unread == {"lines of SONAR": 12, "broken lines of FLASER": 1}


def test_impossible_times_and_places_are_left_out(tmp_path: Path) -> None:
    lines = columns(tmp_path / "drive.txt").read_text().splitlines()
    for number, column, word in ((3, 1, "1e300"), (6, 2, "-20000"), (8, 0, "1e300")):  # after a comment
        words = lines[number].split()
        lines[number] = " ".join([*words[:column], word, *words[column + 1 :]])
    (tmp_path / "odd.txt").write_text("\n".join(lines))
    recording = read_drive_log(tmp_path / "odd.txt")
    assert [scan.odometry for scan in recording.scans] == [POSES[k] for k in range(12) if k not in (2, 5, 7)]
    assert recording.unread == {"impossible scans": 3}


@pytest.mark.parametrize("word", ["nan", "-1", "81.91"])
def test_recording_without_any_echo_is_refused(tmp_path: Path, word: str) -> None:
    ranges = " ".join([word] * 181)
    lines = [f"FLASER 181 {ranges} {k / 10} 0 0 {k / 10} 0 0 {k} host {k}" for k in range(9)]
    (tmp_path / "dark.log").write_text("\n".join(lines))
    with pytest.raises(BadDriveLog, match="no scan has an echo"):
        read_drive_log(tmp_path / "dark.log")


def test_zero_of_a_coreslam_log_is_unknown(tmp_path: Path) -> None:
    rows = np.zeros((3, 706), int)
    rows[:, 0] = [0, 100_000, 200_000]
    rows[:, 2:4] = np.array([0, 1000, 2000])[:, None]  # half a turn of both wheels between two scans
    rows[:, 24:374] = 1500
    np.savetxt(tmp_path / "exp.dat", rows, fmt="%d")
    recording = read_drive_log(tmp_path / "exp.dat")
    assert recording.scans[2].odometry.x == pytest.approx(math.tau * 0.077)
    assert np.isnan(recording.scans[0].scan.ranges[350:]).all()
    assert recording.scans[0].scan.ranges[:350] == pytest.approx(1.5)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"nonsense\n",
        b"1 2 3\n",
        b"1 2 3 4 5\n1 2\n",
        b"FLASER x\n",
        b"\0\1\2",
        b"\x1f\x8bno gzip",
        b"nan nan nan nan 1 2",
    ],
)
def test_files_that_are_no_recording_are_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "drive").write_bytes(content)
    with pytest.raises(BadDriveLog, match="drive"):
        read_drive_log(tmp_path / "drive")


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_damaged_files_raise_nothing_else(tmp_path: Path, data: st.DataObject) -> None:
    writers = (carmen, robotlaser, columns, lambda path: rawlog(path, old=True))
    path = data.draw(st.sampled_from(writers))(tmp_path / "drive")
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 8))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(1, 40))] = data.draw(st.binary(max_size=20))
        if not content:
            break
    path.write_bytes(bytes(content))
    try:
        recording = read_drive_log(path)
    except BadDriveLog:
        return
    assert all(math.isfinite(item.odometry.x) for item in recording.scans)
