"""Binary messages to pages: a scan, a map, a path, each after a head in JSON.

Layout: the head's length (u16, little endian), the head, the payload. Heads carry ``kind`` and ``robot``.
"""

from __future__ import annotations

import struct
import zlib

import msgspec
import numpy as np

from roboglot.console import plain_values
from roboglot.model.geometry import Path, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.sensing import LaserScan

FAR = 65_535  # u16: no echo
SCAN_MAX_METERS = 65.0
UNKNOWN, FREE, OCCUPIED = 0, 1, 2


def framed(head: dict[str, object], payload: bytes) -> bytes:
    """Return one message."""
    text = msgspec.json.encode(head)
    return struct.pack("<H", len(text)) + text + payload


def scan_frame(robot: str, scan: LaserScan, base: Pose) -> bytes:
    """Return a frame of one scan; ``base``: pose of base_link in map at its time. Payload: ranges in mm, u16."""
    near = np.isfinite(scan.ranges) & (scan.ranges < SCAN_MAX_METERS)
    millimeters = np.where(near, np.nan_to_num(scan.ranges, posinf=0.0, neginf=0.0) * 1000.0, FAR).astype("<u2")
    head = {
        "kind": "scan",
        "robot": robot,
        "stamp": round(scan.stamp, 3),
        "pose": plain_values.pose(base.compose(scan.mount)),
        "from": float(scan.angle_min),
        "step": float(scan.angle_increment),
    }
    return framed(head, millimeters.tobytes())


def path_frame(robot: str, path: Path) -> bytes:
    """Return a frame of the remaining path. Payload: x, y in m, f32, in map."""
    coordinates = np.array([(p.x, p.y) for p in path.points], dtype="<f4")
    return framed({"kind": "path", "robot": robot}, coordinates.tobytes())


def map_frame(robot: str, revision: int, grid: OccupancyGrid) -> bytes:
    """Return a frame of the map. Payload: bytes UNKNOWN, FREE or OCCUPIED, rows from the smallest y on, zlib."""
    cells = np.where(grid.log_odds > 0, OCCUPIED, np.where(grid.log_odds < 0, FREE, UNKNOWN)).astype(np.uint8)
    head = {
        "kind": "map",
        "robot": robot,
        "revision": revision,
        "width": grid.width,
        "height": grid.height,
        "resolution": grid.resolution,
        "origin": [grid.origin.x, grid.origin.y],
    }
    return framed(head, zlib.compress(cells.tobytes(), 1))
