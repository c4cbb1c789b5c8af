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

HEAD_BYTES = 65_536
GZIP = b"\x1f\x8b"
CARMEN_WORDS = ("FLASER", "ROBOTLASER", "RAWLASER", "ODOM", "PARAM", "# message_name", "# CARMEN", "SYNC")


def read_drive_log(path: Path) -> DriveLog:
    """Read the recording at ``path``. Raises BadDriveLog, MissingExtra, OSError."""
    log = _read(path)
    middle = np.median([(it.odometry.x, it.odometry.y) for it in log.scans] or [(0.0, 0.0)], axis=0)
    near = [it for it in log.scans if it.scan.stamp < 1e11 and it.odometry.distance_to(Pose(*middle)) < POSITION_MAX]
    if not any(np.isfinite(it.scan.ranges).any() for it in near):
        raise BadDriveLog(f"{path.name}: no scan has an echo")
    if lost := len(log.scans) - len(near):
        log.unread["impossible scans"] = lost
    return DriveLog(log.name, near, log.unread)


def _read(path: Path) -> DriveLog:
    if path.is_dir():
        if is_bag(path, b""):
            return read_bag(path)
        raise BadDriveLog(f"{path.name}: a folder without metadata.yaml is not a ROS bag")
    if path.stat().st_size > FILE_BYTES_MAX:
        raise BadDriveLog(f"{path.name}: larger than {FILE_BYTES_MAX} bytes")
    with path.open("rb") as file:
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
