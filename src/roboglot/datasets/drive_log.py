"""A recorded drive, independent of its file's format. SI units, REP-103/105 frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Pose
from roboglot.model.sensing import LaserScan
from roboglot.values import dataclass

FILE_BYTES_MAX = 4_000_000_000
SCANS_MAX = 2_000_000
RAYS_MAX = 8192
USUAL_SHARE = 0.001  # of all readings: the largest means "no echo" if it recurs at least this often
SICK_NO_ECHO = 80.0  # m from which these scanners report codes instead of distances


class BadDriveLog(ValueError):
    """The file cannot be read as a recorded drive; the message gives the reason."""


@dataclass(frozen=True, slots=True)
class RecordedScan:
    """A scan, odometry at its time, and the file's reference pose or None; both are poses of base_link."""

    scan: LaserScan
    odometry: Pose
    reference: Pose | None = None


@dataclass(frozen=True, slots=True)
class DriveLog:
    """A drive: its ``scans`` in order of time, and the counts of skipped records by reason (``unread``)."""

    name: str
    scans: Sequence[RecordedScan]
    unread: dict[str, int]


def no_echo(ranges: NDArray[np.float64], *, least: float) -> float:
    """Return the reading (m) from which rays have no echo: the largest if it recurs and exceeds ``least``, else inf.

    Scanners report a missing echo as one large number, which depends on the model.
    """
    readings = ranges[np.isfinite(ranges)]
    if not readings.size:
        return float("inf")
    largest = float(readings.max())
    recurs = np.count_nonzero(readings >= largest - 1e-3) >= max(2.0, USUAL_SHARE * readings.size)
    if largest >= SICK_NO_ECHO:
        return SICK_NO_ECHO
    return largest - 1e-3 if recurs and largest >= least else float("inf")


def echoes(ranges: NDArray[np.float64], nothing_from: float, range_min: float) -> NDArray[np.float32]:
    """Return ``ranges`` (m) for a ``LaserScan``: inf from ``nothing_from`` on, NaN below ``range_min``."""
    with np.errstate(over="ignore"):  # values beyond float32 become inf
        result = ranges.astype(np.float32)
    with np.errstate(invalid="ignore"):
        result[ranges >= nothing_from] = np.inf
        result[ranges < range_min] = np.nan
    result.setflags(write=False)
    return result
