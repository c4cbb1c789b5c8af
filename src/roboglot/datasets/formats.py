"""Recognises the format of a recording by its content and reads it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from roboglot.datasets.carmen import read_carmen
from roboglot.datasets.columns import read_columns
from roboglot.datasets.coreslam import COLUMNS, read_coreslam
from roboglot.datasets.drive_log import FILE_BYTES_MAX, BadDriveLog, DriveLog
from roboglot.datasets.own_recording import MAGIC, read_own_recording
from roboglot.datasets.rawlog import read_rawlog
from roboglot.datasets.rosbag import is_bag, read_bag
from roboglot.model.geometry import POSITION_MAX, Pose
from roboglot.text_files import open_bytes

HEAD_BYTES = 65_536
STAMP_MAX = 1e11  # s since 1970, some 3,000 years: a log with later scans is damaged
GZIP = b"\x1f\x8b"
CARMEN_WORDS = ("FLASER", "ROBOTLASER", "RAWLASER", "ODOM", "PARAM", "# message_name", "# CARMEN", "SYNC")


def read_drive_log(path: Path) -> DriveLog:
    """Read the recording at ``path``, without scans from impossible times or places.

    Raises BadDriveLog, MissingExtra, OSError.
    """
    log = _read(path)
    places = [(taken.odometry.x, taken.odometry.y) for taken in log.scans]
    middle = Pose(*np.median(places or [(0.0, 0.0)], axis=0))
    possible = [
        taken
        for taken in log.scans
        if taken.scan.stamp < STAMP_MAX and taken.odometry.distance_to(middle) < POSITION_MAX
    ]
    if not any(np.isfinite(taken.scan.ranges).any() for taken in possible):
        raise BadDriveLog(f"{path.name}: no scan has an echo")
    if lost := len(log.scans) - len(possible):
        log.unread["impossible scans"] = lost
    return DriveLog(log.name, possible, log.unread)


def _read(path: Path) -> DriveLog:
    if path.is_dir():
        if is_bag(path, b""):
            return read_bag(path)
        raise BadDriveLog(f"{path.name}: a folder without metadata.yaml is not a ROS bag")
    if path.stat().st_size > FILE_BYTES_MAX:
        raise BadDriveLog(f"{path.name}: larger than {FILE_BYTES_MAX} bytes")
    with open_bytes(path) as file:
        head = file.read(HEAD_BYTES)
    if is_bag(path, head):
        return read_bag(path)
    if head.startswith(MAGIC):
        return read_own_recording(path)
    if head.startswith(GZIP) or b"\0" in head:
        return read_rawlog(path)
    lines = head.decode("ascii", "replace").splitlines()
    if any(line.startswith(CARMEN_WORDS) for line in lines):
        return read_carmen(path)
    first = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    return read_coreslam(path) if len(first.split()) in COLUMNS else read_columns(path)
