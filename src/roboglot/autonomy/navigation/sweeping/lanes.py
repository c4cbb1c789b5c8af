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


def parts(area: Area, floor: NDArray[np.bool_], frame: GridFrame, width: float) -> list[SweptPart]:
    """Return the parts of ``area`` on open ``floor``, with lanes along its centre line, at most ``width`` m apart."""
    length = area.start.distance_to(area.end)
    if length <= 0.0 or area.half_width <= 0.0:
        return []
    ux, uy = (area.end.x - area.start.x) / length, (area.end.y - area.start.y) / length
    count = min(LANES_MAX, max(1, math.ceil(2 * area.half_width / width)))
    along = np.arange(0.0, length + RESOLUTION / 2, RESOLUTION / 2)
    growing: dict[tuple[int, int], list[Stretch]] = {}
    found: list[list[Stretch]] = []
    for lane in range(count):
        beside = area.half_width * (2.0 * (lane + 0.5) / count - 1.0)
        x0, y0 = area.start.x - uy * beside, area.start.y + ux * beside
        runs = _runs(_sampled(floor, frame, x0 + ux * along, y0 + uy * along))
        next_growing: dict[tuple[int, int], list[Stretch]] = {}
        for run in runs:
            if (run[1] - run[0]) * RESOLUTION / 2 < STRETCH_MIN:
                continue
            ends = [Point(x0 + ux * along[k], y0 + uy * along[k]) for k in (run[0], run[1] - 1)]
            stretch = Stretch(*ends)
            before = [old for old in growing if old[0] < run[1] and run[0] < old[1]]
            if len(before) == 1 and sum(before[0][0] < r[1] and r[0] < before[0][1] for r in runs) == 1:
                part = growing[before[0]]
                part.append(stretch)
            else:
                part = [stretch]
                found.append(part)
            next_growing[run] = part
        growing = next_growing
    return [tuple(part) for part in found]


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


def _runs(is_open: NDArray[np.bool_]) -> list[tuple[int, int]]:
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
