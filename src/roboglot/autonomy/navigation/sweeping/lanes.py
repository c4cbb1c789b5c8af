"""Lanes over the open floor of an area, cut into parts that can be driven to and fro without crossing obstacles.

Neighbouring lanes whose open stretches overlap one to one belong to one part; where a stretch splits or two join,
a part ends and others begin (boustrophedon decomposition). Knows no robot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.rules import GridFrame
from roboglot.autonomy.slam.evidence import RESOLUTION
from roboglot.model.components.mapping.annotations import Area
from roboglot.model.geometry import Point
from roboglot.values import dataclass

STRETCH_MIN = 0.15  # m; shorter open stretches are left out
LANES_MAX = 2000


@dataclass(frozen=True, slots=True)
class Stretch:
    """Stretch from ``start`` to ``end`` (map, m) along one lane."""

    start: Point
    end: Point

    @property
    def length(self) -> float:
        """Length, m."""
        return self.start.distance_to(self.end)


SweptPart = tuple[Stretch, ...]  # one stretch of each of its lanes, in order
Run = tuple[int, int]  # first place of a lane that is open, and the first one that is not


def parts(area: Area, floor: NDArray[np.bool_], frame: GridFrame, width: float) -> list[SweptPart]:
    """Return the parts of ``area`` on open ``floor``, with lanes along its centre line, at most ``width`` m apart."""
    length = area.start.distance_to(area.end)
    if length <= 0.0 or area.half_width <= 0.0:
        return []
    ux, uy = (area.end.x - area.start.x) / length, (area.end.y - area.start.y) / length
    count = min(LANES_MAX, max(1, math.ceil(2 * area.half_width / width)))
    along = np.arange(0.0, length + RESOLUTION / 2, RESOLUTION / 2)
    growing: dict[Run, list[Stretch]] = {}  # the parts that reach the lane before, by its runs
    found: list[list[Stretch]] = []
    for lane in range(count):
        beside = area.half_width * (2.0 * (lane + 0.5) / count - 1.0)
        x, y = area.start.x - uy * beside + ux * along, area.start.y + ux * beside + uy * along
        runs = _runs(_sampled(floor, frame, x, y))
        before, growing = growing, {}
        for run in runs:
            first, end = run
            if (end - first) * RESOLUTION / 2 < STRETCH_MIN:
                continue
            part = _continued(run, runs, before)
            if part is None:
                part = []
                found.append(part)
            part.append(Stretch(Point(x[first], y[first]), Point(x[end - 1], y[end - 1])))
            growing[run] = part
    return [tuple(part) for part in found]


def _continued(run: Run, runs: list[Run], growing: dict[Run, list[Stretch]]) -> list[Stretch] | None:
    """Return the part that a lane's ``run`` continues; None if parts split or join there, or none is beside it."""
    beside = [old for old in growing if _overlap(old, run)]
    if len(beside) == 1 and sum(_overlap(beside[0], other) for other in runs) == 1:
        return growing[beside[0]]
    return None


def _overlap(one: Run, other: Run) -> bool:
    return one[0] < other[1] and other[0] < one[1]


def open_stretches(lane: Stretch, floor: NDArray[np.bool_], frame: GridFrame) -> list[Stretch]:
    """Return the open stretches of ``lane``."""
    count = math.ceil(lane.length / (RESOLUTION / 2)) + 1
    x, y = (np.linspace(a, b, count) for a, b in ((lane.start.x, lane.end.x), (lane.start.y, lane.end.y)))
    runs = _runs(_sampled(floor, frame, x, y))
    found = [Stretch(Point(float(x[a]), float(y[a])), Point(float(x[b - 1]), float(y[b - 1]))) for a, b in runs]
    return [stretch for stretch in found if stretch.length >= STRETCH_MIN]


def _sampled(
    floor: NDArray[np.bool_], frame: GridFrame, x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return whether the floor is open, for each place (map, m)."""
    columns = np.floor((x - frame.corner.x) / RESOLUTION).astype(np.int64)
    rows = np.floor((y - frame.corner.y) / RESOLUTION).astype(np.int64)
    inside = (rows >= 0) & (columns >= 0) & (rows < frame.shape[0]) & (columns < frame.shape[1])
    is_open = np.zeros(len(x), bool)
    is_open[inside] = floor[rows[inside], columns[inside]]
    return is_open


def _runs(is_open: NDArray[np.bool_]) -> list[Run]:
    """Return [begin, end) of all runs of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], is_open, [False]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def zigzag(part: SweptPart, start: Point) -> list[Point]:
    """Return the ends of the lanes to and fro, from the part's corner nearest to ``start``."""
    ways = [list(_to_and_fro(lanes, flipped)) for lanes in (part, tuple(reversed(part))) for flipped in (False, True)]
    return min(ways, key=lambda way: start.distance_to(way[0]))


def _to_and_fro(lanes: Sequence[Stretch], flipped: bool) -> list[Point]:
    way: list[Point] = []
    for lane in lanes:
        way += [lane.end, lane.start] if flipped else [lane.start, lane.end]
        flipped = not flipped
    return way
