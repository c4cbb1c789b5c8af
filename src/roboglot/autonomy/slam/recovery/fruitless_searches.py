"""Pauses between searches of the whole map that found no place, or several, while the robot sees the same from there.

The same view of the same map is unlikely to give another answer. Knows no map and no search.
"""

from __future__ import annotations

import math

import numpy as np

from roboglot.autonomy.slam.scan_points import Floats, ScanPoints
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.values import dataclass

PAUSE, PAUSE_MAX = 1.0, 16.0  # s between searches, which become rarer
SECTORS = 72  # around the robot, of which the nearest echoes are compared
FAR = 20.0  # m: the nearest echo counts as this far where there is none, or a farther one
CHANGED = 0.15  # m, and this share of the distance, by which a sector's nearest echo changes
CHANGED_MAX = 3  # sectors that change by noise
MOVED, MOVED_YAW = 0.02, math.radians(1.0)  # m, rad by odometry


@dataclass(frozen=True, slots=True)
class View:
    """View of a robot: the nearest echo in each sector, m, at ``odometry`` (odom); its map, of so many ``scans``."""

    map: object
    scans: int
    odometry: Pose
    nearest: Floats

    def is_like(self, other: View) -> bool:
        """Return whether nothing but noise sets them apart."""
        if self.map is not other.map or self.scans != other.scans:
            return False
        if not self.odometry.is_near(other.odometry, MOVED, MOVED_YAW):
            return False
        limits = CHANGED * np.maximum(1.0, np.minimum(self.nearest, other.nearest))
        return int(np.count_nonzero(np.abs(self.nearest - other.nearest) > limits)) <= CHANGED_MAX


def nearest_echoes(scan: ScanPoints) -> Floats:
    """Return the distance of the nearest echo in each sector, m, at most FAR."""
    nearest, points = np.full(SECTORS, FAR), scan.points
    sectors = np.floor(np.arctan2(points[:, 1], points[:, 0]) * (SECTORS / math.tau)).astype(np.intp) % SECTORS
    np.minimum.at(nearest, sectors, np.hypot(points[:, 0], points[:, 1]))
    return nearest


class FruitlessSearches:
    """Fruitless searches in a row, from one place with one view."""

    def __init__(self) -> None:
        self._last = View(None, 0, ORIGIN, np.empty(0))
        self._until, self._pause = -math.inf, PAUSE

    def forget(self) -> None:
        """Forget them: the next search need not wait."""
        self._until, self._pause = -math.inf, PAUSE

    def add(self, view: View, stamp: float) -> None:
        """Add one, of ``view``."""
        self._last, self._until, self._pause = view, stamp + self._pause, min(2.0 * self._pause, PAUSE_MAX)

    def forbid(self, view: View, stamp: float) -> bool:
        """Return whether to wait, as searches of such a view were fruitless lately; forget those of another one."""
        if math.isfinite(self._until) and not view.is_like(self._last):
            self.forget()
        return stamp < self._until
