"""Logs of CoreSLAM (Mines ParisTech): 24 columns of state, two of them the wheels' counters, then ranges in mm.

The robot's dimensions were published with the logs. A range of 0 to 19 is an error code of the scanner.
"""

from __future__ import annotations

import math
from pathlib import Path

from roboglot.datasets.columns import table
from roboglot.datasets.drive_log import BadDriveLog, DriveLog, RecordedScan, echoes
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.model.sensing import LaserScan

STATE_COLUMNS, RAYS = 24, 682
COLUMNS = (STATE_COLUMNS + RAYS, STATE_COLUMNS + RAYS + 1)  # some files have an empty last column
WHEEL_RADIUS, HALF_AXLE = 0.077, 0.165  # m
COUNTS_A_TURN = 2000
FIELD_OF_VIEW = math.radians(240.0)
LIDAR = Pose(x=0.145)  # in base_link
TIME_INCREMENT = 0.1 / 1024  # s: ten turns of 1024 steps per second
RANGE_MIN, RANGE_MAX = 0.02, 5.6  # m


def read_coreslam(path: Path) -> DriveLog:
    """Read the log at ``path``. Raises BadDriveLog."""
    rows = table(path)
    if rows.shape[1] not in COLUMNS:
        raise BadDriveLog(f"{path.name}: {rows.shape[1]} columns; a log of CoreSLAM has {COLUMNS[0]}")
    increment = FIELD_OF_VIEW / (RAYS - 1)
    scans, pose, before = [], ORIGIN, rows[0, 2:4]
    for row in rows:
        left, right = (math.tau * WHEEL_RADIUS / COUNTS_A_TURN * (row[2:4] - before)).tolist()
        before = row[2:4]
        pose = driven(pose, (left + right) / 2, (right - left) / (2 * HALF_AXLE))
        ranges = echoes(row[STATE_COLUMNS : STATE_COLUMNS + RAYS] / 1000.0, math.inf, RANGE_MIN)
        scan = LaserScan(
            float(row[0]) * 1e-6,
            ranges,
            -FIELD_OF_VIEW / 2,
            increment,
            RANGE_MIN,
            RANGE_MAX,
            mount=LIDAR,
            time_increment=TIME_INCREMENT,
        )
        scans.append(RecordedScan(scan, pose))
    return DriveLog(path.stem, scans, {})


def driven(pose: Pose, way: float, turn: float) -> Pose:
    """Return ``pose`` after an arc of ``way`` m that turns by ``turn`` rad."""
    chord = way if abs(turn) < 1e-9 else way * math.sin(turn / 2) / (turn / 2)
    return pose.compose(Pose(chord * math.cos(turn / 2), chord * math.sin(turn / 2), turn))
