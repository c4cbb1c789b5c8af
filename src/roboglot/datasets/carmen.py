"""CARMEN logs, the format of Radish's data sets: FLASER, ROBOTLASER1, RAWLASER1 with ODOM, and PARAM lines."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from roboglot.datasets.drive_log import RAYS_MAX, SCANS_MAX, BadDriveLog, DriveLog, RecordedScan, echoes, no_echo
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.sensing import LaserScan
from roboglot.text_files import open_text
from roboglot.values import dataclass

RANGE_MIN, LEAST_NO_ECHO = 0.03, 5.0  # m
OFFSET_SAME = 0.01  # m, rad: apparent motion of a fixed laser, caused by rounding
LINE_MAX = 200_000  # characters


@dataclass(slots=True)
class _Line:
    """A scan from one line: ``laser`` and ``robot`` poses in the log's frame."""

    stamp: float
    ranges: NDArray[np.float64]
    angle_min: float
    increment: float
    laser: Pose
    robot: Pose


@dataclass(slots=True)
class _Log:
    scans: list[_Line] = field(default_factory=list)
    unread: Counter[str] = field(default_factory=Counter)
    odometry: Pose | None = None  # from the newest ODOM line
    offset: float = 0.0  # m from base_link ahead to the front laser, from a PARAM line


def read_carmen(path: Path) -> DriveLog:
    """Read the log at ``path``. Raises BadDriveLog if it has no scan of the front laser."""
    log = _Log()
    with open_text(path, "ascii", "replace") as lines:
        for line in _bounded(lines):
            words = line.split()
            reader = _READERS.get(words[0]) if words else None
            if reader is None:
                if words and not words[0].startswith("#"):
                    log.unread[f"lines of {words[0][:20]}"] += 1
                continue
            try:
                reader(log, words)
            except (ValueError, IndexError):
                log.unread[f"broken lines of {words[0]}"] += 1
            if len(log.scans) > SCANS_MAX:
                raise BadDriveLog(f"{path.name}: more than {SCANS_MAX} scans")
    if not log.scans:
        raise BadDriveLog(f"{path.name}: no FLASER, ROBOTLASER1 or RAWLASER1 line")
    return DriveLog(path.stem, _scans(log), dict(log.unread))


def _bounded(lines: Iterator[str]) -> Iterator[str]:
    return (line for line in lines if len(line) <= LINE_MAX)


def _scans(log: _Log) -> Sequence[RecordedScan]:
    """Return the scans with values from the whole log: the laser's mount, and the reading that means "no echo"."""
    lines = sorted(log.scans, key=lambda line: line.stamp)
    offsets = np.array([_tuple(line.laser.relative_to(line.robot)) for line in lines])
    middle = np.median(offsets, axis=0)
    rigid = bool((np.abs(offsets - middle).max(axis=0) < OFFSET_SAME).all())
    mount = Pose(*middle.tolist()) if rigid else Pose(x=log.offset)
    some = np.concatenate([line.ranges for line in lines[:: max(1, len(lines) // 1000)]])
    nothing_from = no_echo(some, least=LEAST_NO_ECHO)
    near = some[some < nothing_from]
    reach = float(near.max()) if near.size else LEAST_NO_ECHO
    result = []
    for line in lines:
        ranges = echoes(line.ranges, nothing_from, RANGE_MIN)
        scan = LaserScan(line.stamp, ranges, line.angle_min, line.increment, RANGE_MIN, reach, mount=mount)
        # Logs corrected by a SLAM program have the corrected pose in place of the laser's.
        reference = None if rigid else line.laser.compose(mount.inverse())
        result.append(RecordedScan(scan, line.robot, reference))
    return result


def _tuple(pose: Pose) -> tuple[float, float, float]:
    return pose.x, pose.y, pose.yaw


def _pose(words: Sequence[str]) -> Pose:
    x, y, yaw = map(float, words)
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(yaw)):
        raise ValueError("no pose")
    return Pose(x, y, wrap_angle(yaw))


def _ranges(words: Sequence[str], count: int) -> NDArray[np.float64]:
    if not 2 <= count <= RAYS_MAX or len(words) < count:
        raise ValueError("no scan")
    return np.array(words[:count], np.float64)


def _stamp(words: Sequence[str]) -> float:
    """Return the time (s) at the line's end: ipc_timestamp host logger_timestamp. The first is the scan's."""
    return float(words[0]) if float(words[0]) > 0 or len(words) < 3 else float(words[2])


def _flaser(log: _Log, words: list[str]) -> None:
    count = int(words[1])
    ranges, rest = _ranges(words[2:], count), words[2 + count :]
    increment = math.pi / (count - 1) if count % 2 else math.pi / count
    log.scans.append(_Line(_stamp(rest[6:]), ranges, -math.pi / 2, increment, _pose(rest[:3]), _pose(rest[3:6])))


def _robotlaser(log: _Log, words: list[str]) -> None:
    angle_min, increment = float(words[2]), float(words[4])
    count = int(words[8])
    ranges, rest = _ranges(words[9:], count), words[9 + count :]
    rest = rest[1 + int(rest[0]) :]  # a count of remissions, then the remissions
    # laser pose, robot pose, tv, rv, forward and side safety distance, turn axis, then the time
    log.scans.append(_Line(_stamp(rest[11:]), ranges, angle_min, increment, _pose(rest[:3]), _pose(rest[3:6])))


def _rawlaser(log: _Log, words: list[str]) -> None:
    """Read a scan without a pose: the newest ODOM line has it."""
    if log.odometry is None:
        raise ValueError("a scan before odometry")
    angle_min, increment = float(words[2]), float(words[4])
    count = int(words[8])
    ranges, rest = _ranges(words[9:], count), words[9 + count :]
    rest = rest[1 + int(rest[0]) :]
    laser = log.odometry.compose(Pose(x=log.offset))
    log.scans.append(_Line(_stamp(rest), ranges, angle_min, increment, laser, log.odometry))


def _odom(log: _Log, words: list[str]) -> None:
    log.odometry = _pose(words[1:4])


def _param(log: _Log, words: list[str]) -> None:
    if words[1] in ("robot_frontlaser_offset", "robot_front_laser_offset"):
        log.offset = float(words[2])


_READERS = {
    "FLASER": _flaser,
    "ROBOTLASER1": _robotlaser,
    "RAWLASER1": _rawlaser,
    "ODOM": _odom,
    "PARAM": _param,
}
