"""Moving things around the robot, by its lidar: echoes that the map does not explain, tracked over scans.

Knows no robot and no radio; needs the kernels. All positions are in map, m.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.kernels.obstacles import things
from roboglot.model.geometry import Point, Pose
from roboglot.values import dataclass

LINK = 0.25  # m between neighbouring echoes of one object
WIDE_MAX = 0.9  # m; anything wider is neither a robot nor a person
ECHOES_MIN = 3
HULL = 0.27  # m: the assumed radius of an object whose back is not visible
DEPTH = 0.6 * HULL  # m from the centre of the echoes to that of the object
SAME = 0.45  # m between an object's predicted and observed place
KEPT = 5  # sightings from which a velocity is computed
FORGOTTEN = 0.5  # s without a sighting
MOVES = 0.2  # m/s, less is noise
THINGS_MAX = 32

Points = NDArray[np.float64]


@dataclass(slots=True)
class Mover:
    """A thing that stands or moves: ``vx`` and ``vy`` in m/s, 0 if it hardly moves; ``radius`` in m."""

    x: float
    y: float
    stamp: float
    since: float  # s: time of its first sighting
    radius: float = HULL
    vx: float = 0.0
    vy: float = 0.0
    heading: float = 0.0  # rad: direction of the last motion
    moved_at: float = -math.inf  # s: time of the last motion
    travelled: float = 0.0  # m: its largest distance from its first place
    _first: Point | None = None
    _seen: deque[tuple[float, float, float]] = field(default_factory=lambda: deque(maxlen=KEPT))

    @property
    def point(self) -> Point:
        """Middle of the mover in map, m."""
        return Point(self.x, self.y)

    @property
    def speed(self) -> float:
        """Speed, m/s."""
        return math.hypot(self.vx, self.vy)

    def take(self, x: float, y: float, stamp: float) -> None:
        """Take a new sighting."""
        self._seen.append((stamp, x, y))
        self.x, self.y, self.stamp = x, y, stamp
        self._first = self._first or self.point
        self.travelled = max(self.travelled, self._first.distance_to(self.point))
        if len(self._seen) < 3:
            return
        middle = sum(stamp for stamp, _, _ in self._seen) / len(self._seen)
        spread = along = up = 0.0
        for seen_at, seen_x, seen_y in self._seen:
            late = seen_at - middle
            spread, along, up = spread + late * late, along + late * seen_x, up + late * seen_y
        if spread <= 0.0:
            return
        vx, vy = along / spread, up / spread
        moves = math.hypot(vx, vy) >= MOVES
        self.vx, self.vy = (vx, vy) if moves else (0.0, 0.0)
        if moves:
            self.heading, self.moved_at = math.atan2(vy, vx), stamp


class MoverTracker:
    """Tracker of movers over all scans."""

    def __init__(self) -> None:
        self.movers = list[Mover]()

    def observe(self, echoes: Points, grid: EvidenceGrid, pose: Pose, stamp: float) -> Sequence[Mover]:
        """Return the things around that are not on the map; ``echoes`` (n, 2; map) in the order of the scan."""
        self.movers = [mover for mover in self.movers if stamp - mover.stamp <= FORGOTTEN]
        free = list(self.movers)
        corner = grid.corner
        found = things(grid.evidence, echoes, corner.x, corner.y, RESOLUTION, LINK, WIDE_MAX, ECHOES_MIN)
        for x, y in (_middle(x, y, pose) for x, y in found.tolist()):
            mover = _expected(free, x, y, stamp)
            if mover is not None:
                free.remove(mover)
            elif len(self.movers) < THINGS_MAX:
                mover = Mover(x, y, stamp, stamp)
                self.movers.append(mover)
            else:
                continue
            mover.take(x, y, stamp)
        return self.movers


def _expected(movers: Sequence[Mover], x: float, y: float, stamp: float) -> Mover | None:
    """Return the mover whose predicted place is nearest to (x, y); None: none is near."""
    best, found = SAME, None
    for mover in movers:
        seconds = stamp - mover.stamp
        away = math.hypot(mover.x + mover.vx * seconds - x, mover.y + mover.vy * seconds - y)
        if away < best:
            best, found = away, mover
    return found


def _middle(x: float, y: float, pose: Pose) -> tuple[float, float]:
    """Return the middle of a thing whose front, seen from ``pose``, has its middle at (x, y)."""
    away = max(math.hypot(x - pose.x, y - pose.y), 1e-6)
    return x + DEPTH * (x - pose.x) / away, y + DEPTH * (y - pose.y) / away
