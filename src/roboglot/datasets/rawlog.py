"""MRPT ``.rawlog`` files: laser scans with odometry of actions or observations, in every version of the classes.

Objects are found by their headers, so classes that are of no use for maps (images, satellites, gas) need no reader.
Files are read, and unpacked, piece by piece: only the scans stay in memory.
"""

from __future__ import annotations

import gzip
import math
import re
import struct
import zlib
from collections import Counter
from collections.abc import Generator, Iterator, Sequence
from io import BufferedIOBase
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from roboglot.datasets.drive_log import FILE_BYTES_MAX, RAYS_MAX, SCANS_MAX, BadDriveLog, DriveLog, RecordedScan
from roboglot.datasets.mounts import level_mount, rotation
from roboglot.model.geometry import ORIGIN, Pose, wrap_angle
from roboglot.model.sensing import LaserScan
from roboglot.text_files import open_bytes
from roboglot.values import dataclass

SCAN, ODOMETRY, MOVEMENT, POSE = "CObservation2DRangeScan", "CObservationOdometry", "CActionRobotMovement2D", "CPose2D"
NAMES = re.compile(b"|".join(name.encode() for name in (SCAN, ODOMETRY, MOVEMENT)))
BEGIN_MAX = 48  # bytes of a header before the name: the length in one byte, or in four in old files; the namespace
BEGIN = rb"(?:[\x80-\xff](?:mrpt::\w{1,39}::)?|[\x05-\x40]\0\0\0)"
NAME_BEGIN, POSE_HEADER = re.compile(BEGIN + rb"\Z"), re.compile(BEGIN + POSE.encode())
POSE_WITHIN = 200  # bytes after a movement's header within which its mean pose begins
EPOCH = 11_644_473_600  # s from 1601, the epoch of MRPT, to 1970
LABEL_MAX = 1000  # characters
RANGE_MIN = 0.03  # m
PIECE = 8 << 20  # bytes that are read at a time
OBJECT_MAX = 64 << 10  # bytes of a scan, from the first of its header, of which RAYS_MAX take 40 KB
READINGS_MAX = 200_000_000  # of all scans


class _Reader:
    """Reads little-endian values in sequence. Raises struct.error at the end."""

    def __init__(self, data: bytes, at: int) -> None:
        self._data, self._at = data, at
        self._old = False

    def take(self, form: str) -> tuple[float, ...]:
        values = struct.unpack_from("<" + form, self._data, self._at)
        self._at += struct.calcsize("<" + form)
        return values

    def array(self, kind: str, count: int) -> NDArray[np.generic]:
        size = np.dtype(kind).itemsize * count
        if self._at + size > len(self._data):
            raise struct.error("the file ends within an object")
        self._at += size
        return np.frombuffer(self._data, kind, count, self._at - size)

    def begin(self) -> int:
        """Skip an object's header; return its version."""
        self._old = self._data[self._at : self._at + 1] < b"\x80"
        (length,) = self.take("I" if self._old else "B")
        self._at += int(length) & 0x7F
        return int(self.take("I" if self._old else "B")[0])

    def matrix(self, kind: str) -> NDArray[np.float64]:
        rows, columns = (int(size) for size in self.take("II"))
        if rows * columns > 100:
            raise ValueError("the matrix is too large for a pose")
        return self.array(kind, rows * columns).reshape(rows, columns).astype(np.float64)

    def end(self) -> None:
        """Read the mark at the end of an object, which old files lack."""
        if not self._old and self.take("B") != (0x88,):
            raise ValueError("the object is longer than expected")


@dataclass(slots=True)
class _Scan:
    label: str
    scan: LaserScan
    odometry: Pose | None  # sum of the actions so far; None in files without actions


def read_rawlog(path: Path) -> DriveLog:
    """Read the file at ``path``. Raises BadDriveLog."""
    unread = Counter[str]()
    scans, stamped = _objects(path, unread)
    if not scans:
        raise BadDriveLog(f"{path.name}: no readable {SCAN}")
    label, _ = Counter(scan.label for scan in scans).most_common(1)[0]
    unread.update(f"scans of {scan.label}" for scan in scans if scan.label != label)
    chosen = [scan for scan in scans if scan.label == label]
    recorded = _joined(chosen, stamped) if stamped else [RecordedScan(s.scan, s.odometry or ORIGIN) for s in chosen]
    return DriveLog(path.stem, recorded, dict(unread))


def _objects(path: Path, unread: Counter[str]) -> tuple[list[_Scan], list[tuple[float, Pose]]]:
    """Return the scans, and the odometry with its stamps; what cannot be read is counted in ``unread``.

    Raises BadDriveLog.
    """
    scans: list[_Scan] = []
    stamped: list[tuple[float, Pose]] = []
    pose, moved, readings = ORIGIN, False, 0
    for data, name, begin in _headers(path):
        kind = name[0].decode()
        try:
            if kind == SCAN:
                scans.append(_scan(data, begin, pose if moved else None))
                readings += len(scans[-1].scan.ranges)
            elif kind == ODOMETRY:
                stamped.append(_odometry(data, begin))
            else:
                pose, moved = pose.compose(_movement(data, name.end())), True
        except (ValueError, struct.error) as error:
            unread[f"{kind}: {error}"] += 1
        if len(scans) > SCANS_MAX or readings > READINGS_MAX:
            raise BadDriveLog(f"{path.name}: more than {SCANS_MAX} scans or {READINGS_MAX} readings")
    return scans, stamped


def _headers(path: Path) -> Iterator[tuple[bytes, re.Match[bytes], int]]:
    """Yield the name of each object, with the piece of the file in which the whole object lies, and its begin there.

    Raises BadDriveLog.
    """
    data, size = b"", 0
    try:
        with _opened(path) as file:
            while piece := file.read(PIECE):
                if (size := size + len(piece)) > FILE_BYTES_MAX:
                    raise BadDriveLog(f"{path.name}: more than {FILE_BYTES_MAX} bytes unpacked")
                data += piece
                data = data[(yield from _headers_in(data, len(data) - OBJECT_MAX)) :]
    except (OSError, EOFError, zlib.error) as error:
        raise BadDriveLog(f"{path.name}: {error}") from None
    yield from _headers_in(data, len(data))


def _headers_in(data: bytes, until: int) -> Generator[tuple[bytes, re.Match[bytes], int], None, int]:
    """Yield the headers with names before ``until``; return where to search on."""
    after = 0
    for name in NAMES.finditer(data, 0, max(until, 0)):
        first = max(after, name.start() - BEGIN_MAX)
        if begins := NAME_BEGIN.search(data, first, name.start()):
            yield data, name, begins.start()
            after = name.end()
    return max(after, until - BEGIN_MAX)


def _opened(path: Path) -> BufferedIOBase:
    with open_bytes(path) as file:
        packed = file.read(2) == b"\x1f\x8b"
    return gzip.open(path) if packed else open_bytes(path)


def _joined(scans: Sequence[_Scan], stamped: Sequence[tuple[float, Pose]]) -> list[RecordedScan]:
    """Return scans with odometry interpolated at their times; angles are interpolated the short way."""
    ordered = sorted(stamped, key=lambda item: item[0])
    times = np.array([stamp for stamp, _ in ordered])
    yaws = np.unwrap([pose.yaw for _, pose in ordered])
    result = []
    for scan in scans:
        stamp = scan.scan.stamp
        x, y = (float(np.interp(stamp, times, [getattr(pose, axis) for _, pose in ordered])) for axis in "xy")
        result.append(RecordedScan(scan.scan, Pose(x, y, wrap_angle(float(np.interp(stamp, times, yaws))))))
    return result


def _movement(data: bytes, at: int) -> Pose:
    """Return the mean pose of a movement."""
    found = POSE_HEADER.search(data, at, at + POSE_WITHIN)
    if found is None:
        raise ValueError("the motion has no mean pose")
    reader = _Reader(data, found.start())
    return _plane(reader, reader.begin())


def _plane(reader: _Reader, version: int) -> Pose:
    x, y, yaw = reader.take("fff" if version == 0 else "ddd")
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(yaw)):
        raise ValueError("a pose is not a number")
    return Pose(x, y, wrap_angle(yaw))


def _odometry(data: bytes, at: int) -> tuple[float, Pose]:
    reader = _Reader(data, at)
    reader.begin()
    pose = _plane(reader, reader.begin())
    reader.end()
    _label(reader)
    return _stamp(reader), pose


def _label(reader: _Reader) -> str:
    length = int(reader.take("I")[0])
    if length > LABEL_MAX:
        raise ValueError("no label")
    return reader.array("u1", length).tobytes().decode("latin-1")


def _stamp(reader: _Reader) -> float:
    return reader.take("Q")[0] / 1e7 - EPOCH


def _mount(reader: _Reader) -> tuple[Pose, bool]:
    """Return the scanner's pose in the plane, and True if it is upside down. Raises ValueError if it is tilted."""
    version = reader.begin()
    if version == 2:
        x, y, _, w, i, j, k = reader.take("7d")
        turned = rotation(w, i, j, k)
    elif version == 3:
        x, y, _ = reader.take("3d")
        turned = reader.array("<f8", 9).reshape(3, 3).astype(np.float64)
    else:
        reader.begin()  # a matrix stored as an object
        matrix = reader.matrix("<f4" if version == 0 else "<f8")
        reader.end()
        if matrix.shape[0] < 3 or matrix.shape[1] < 4:
            raise ValueError("the matrix is too small for a pose")
        turned, x, y = matrix[:3, :3], float(matrix[0, 3]), float(matrix[1, 3])
    reader.end()
    return level_mount(turned, x, y)


def _scan(data: bytes, at: int, odometry: Pose | None) -> _Scan:
    reader = _Reader(data, at)
    version = reader.begin()
    if version > 7:
        raise ValueError(f"version {version} is unknown")
    aperture, leftwards, range_max = reader.take("fBf")
    mount, flipped = _mount(reader)
    if version < 6:
        reader.begin()
        reader.matrix("<f4")
        reader.end()
    count = int(reader.take("I")[0])
    if not 2 <= count <= RAYS_MAX or not 0.0 < aperture <= math.tau + 1e-3:
        raise ValueError("no scan")
    ranges = reader.array("<f4", count).astype(np.float32)
    valid = reader.array("u1", count) != 0 if version >= 1 else ranges < range_max
    if version >= 2:
        reader.take("f")
    stamp = _stamp(reader) if version >= 3 else 0.0
    if version >= 4:
        reader.take("f")
    label = _label(reader) if version >= 5 else ""
    ranges[~valid & (ranges < range_max)] = np.nan
    ranges[ranges >= range_max] = np.inf
    ranges[ranges < RANGE_MIN] = np.nan
    if bool(leftwards) == flipped:  # from left to right as seen from above
        ranges = ranges[::-1].copy()
    ranges.setflags(write=False)
    scan = LaserScan(stamp, ranges, -aperture / 2, aperture / (count - 1), RANGE_MIN, range_max, mount=mount)
    return _Scan(label, scan, odometry)
