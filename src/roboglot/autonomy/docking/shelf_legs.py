"""A shelf on the jack: its legs show in every scan and are not part of the world; it needs more room than the hull.

From lifting to setting down, scans leave its legs out, the planner keeps its corners clear of obstacles, and the map's
cells of its former place no longer count.
"""

from __future__ import annotations

import math
from dataclasses import field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.docking.mark_finder import LEG_HALF, SIDE_MIN, SQUARE, legs_of
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.evidence import EvidenceGrid
from roboglot.autonomy.slam.scan_points import ScanReader
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.events import JackChanged
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.values import dataclass

Floats = NDArray[np.float64]
REACH = 1.1  # m from base_link within which a lifted object's legs stand
NEAREST = 10  # legs tried as corners
SHELVES_MAX = 32  # places of removed shelves that are remembered


@dataclass(slots=True)
class Load:
    """Load on the jack, and the former places (map, m) of removed shelves that the map still shows."""

    radius: float = 0.0  # m around base_link that the shelf occupies
    gone: list[Floats] = field(default_factory=list)  # (n, 2): the legs of each removed shelf
    grid: EvidenceGrid | None = None  # the map to which ``gone`` refers

    def gone_from(self, grid: EvidenceGrid) -> Floats:
        """Return the former places (n, 2) of legs that ``grid`` may still show."""
        return np.concatenate(self.gone) if self.gone and grid is self.grid else np.empty((0, 2))


class CarriedLegs:
    """Updates the belief's scan filter and the load when the jack changes."""

    def __init__(self, robot: Robot, belief: Belief, load: Load) -> None:
        self._robot, self._belief, self._load = robot, belief, load
        self._stop = robot.events.listen(JackChanged, self._changed)

    def close(self) -> None:
        """Stop listening."""
        self._stop()

    def _changed(self, _: JackChanged) -> None:
        reader = self._belief.reader
        if not self._robot[Jack].loaded:
            if reader.carried is not None:
                self._set_down(reader.carried)
            reader.carried, self._load.radius = None, 0.0
        elif reader.carried is None and (scan := self._robot[Lidar].scan) is not None:
            legs = standing_among(legs_of(ScanReader().read(scan).points))
            reader.carried = np.array([(leg.x, leg.y) for leg in legs]).reshape(-1, 2)
            self._take_up(reader.carried)

    def _take_up(self, legs: Floats) -> None:
        load, belief = self._load, self._belief
        if not len(legs):
            return
        load.radius = float(np.hypot(*legs.T).max()) + LEG_HALF * math.sqrt(2.0)
        if load.grid is not belief.map:
            load.grid, load.gone = belief.map, []
        load.gone = [*load.gone, _on_map(legs, belief.pose)][-SHELVES_MAX:]

    def _set_down(self, legs: Floats) -> None:
        """Forget removed shelves near the place of the shelf that was set down."""
        here = _on_map(legs, self._belief.pose)
        if len(here):
            load, radius = self._load, self._load.radius
            load.gone = [was for was in load.gone if np.hypot(*(was.mean(axis=0) - here.mean(axis=0))) > 2.0 * radius]


def standing_among(legs: list[Point]) -> list[Point]:
    """Return the four legs of the smallest rectangle around the robot; without one, all legs within reach."""
    near = [leg for leg in legs if math.hypot(leg.x, leg.y) < REACH]
    best: tuple[float, list[Point]] | None = None
    for (a, c), (b, d) in combinations(combinations(near[:NEAREST], 2), 2):
        corners = [a, b, c, d]
        apart = Point((a.x + c.x - b.x - d.x) / 2, (a.y + c.y - b.y - d.y) / 2)
        square = math.hypot(apart.x, apart.y) < SQUARE and abs(a.distance_to(c) - b.distance_to(d)) < SQUARE
        if not square or min(a.distance_to(b), b.distance_to(c)) < SIDE_MIN or not _around(corners):
            continue
        size = a.distance_to(c)
        if best is None or size < best[0]:
            best = size, corners
    return best[1] if best else near


def _around(corners: list[Point]) -> bool:
    """True if base_link is inside the corners, which are in order around the rectangle."""
    turns = [a.x * b.y - a.y * b.x for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    return min(turns) > 0.0 or max(turns) < 0.0


def _on_map(legs: Floats, pose: Pose) -> Floats:
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    turned: Floats = legs @ np.array([[c, s], [-s, c]])
    turned += (pose.x, pose.y)
    return turned
