"""Plain tables, one line per scan: stamp, odometry x y yaw, optionally a reference x y yaw, then the ranges in m.

180, 181, 360 or 361 ranges span 180 degrees, from the right to the left; other counts span 360 degrees.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from roboglot.datasets.drive_log import RAYS_MAX, SCANS_MAX, BadDriveLog, DriveLog, RecordedScan, echoes, no_echo
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.sensing import LaserScan
from roboglot.text_files import open_text

HALF_CIRCLES = {180: math.pi / 180, 181: math.pi / 180, 360: math.pi / 360, 361: math.pi / 360}
RANGE_MIN, LEAST_NO_ECHO = 0.05, 3.0  # m


def read_columns(path: Path) -> DriveLog:
    """Read the table at ``path``. Raises BadDriveLog."""
    rows = table(path)
    heads = 7 if rows.shape[1] - 7 in HALF_CIRCLES or rows.shape[1] - 4 not in HALF_CIRCLES else 4
    count = rows.shape[1] - heads
    if count < 2:
        raise BadDriveLog(f"{path.name}: {rows.shape[1]} columns are too few for stamp, pose and ranges")
    angle_min = -math.pi / 2 if count in HALF_CIRCLES else -math.pi
    increment = HALF_CIRCLES.get(count, math.tau / count)
    nothing_from = no_echo(rows[:, heads:], least=LEAST_NO_ECHO)
    farthest = rows[:, heads:][rows[:, heads:] < nothing_from]
    reach = float(farthest.max()) if farthest.size else RANGE_MIN
    scans = []
    for row in rows:
        ranges = echoes(row[heads:], nothing_from, RANGE_MIN)
        x, y, yaw = row[1:4].tolist()
        scan = LaserScan(float(row[0]), ranges, angle_min, increment, RANGE_MIN, reach)
        reference = Pose(float(row[4]), float(row[5]), wrap_angle(float(row[6]))) if heads == 7 else None
        scans.append(RecordedScan(scan, Pose(x, y, wrap_angle(yaw)), reference))
    return DriveLog(path.stem, scans, {})


def table(path: Path) -> NDArray[np.float64]:
    """Return the numbers of a text file with lines of equal length; lines that begin with # are comments."""
    rows: list[NDArray[np.float64]] = []
    with open_text(path, "ascii", "replace") as lines:
        for number, line in enumerate(lines, 1):
            if line.startswith("#") or not line.strip():
                continue
            try:
                row = np.array(line.split(), np.float64)
            except ValueError:
                raise BadDriveLog(f"{path.name}, line {number}: not a line of numbers") from None
            if rows and len(row) != len(rows[0]):
                raise BadDriveLog(f"{path.name}, line {number}: {len(row)} columns, the lines before {len(rows[0])}")
            if len(rows) >= SCANS_MAX or len(row) > RAYS_MAX:
                raise BadDriveLog(f"{path.name}, line {number}: more than {SCANS_MAX} scans or {RAYS_MAX} columns")
            rows.append(row)
    if not rows:
        raise BadDriveLog(f"{path.name}: no line of numbers")
    result = np.stack(rows)
    if not np.isfinite(result[:, :4]).all():
        raise BadDriveLog(f"{path.name}: a stamp or a pose is not a number")
    return result
