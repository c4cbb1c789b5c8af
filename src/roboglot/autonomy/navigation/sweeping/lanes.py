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
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Point
from roboglot.values import dataclass

STRETCH_MIN = 0.15  # m; shorter open stretches are left out
LANES_MAX = 2000  # of a sweep


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


@dataclass(frozen=True, slots=True)
class _Field:
    """Part of an area that the map covers: ``corner`` (map, m), direction of its lanes, extents along and across, m."""

    corner: Point
    ux: float
    uy: float
    length: float
    width: float

    def lanes(self, apart: float) -> int:
        """Return the number of lanes, at most ``apart`` m from each other."""
        return max(1, math.ceil(self.width / apart))


def _field(area: Area, frame: GridFrame) -> _Field | None:
    """Return the part of ``area`` on the map, as an area may be much larger than any map; None: there is none."""
    length, height, width = area.start.distance_to(area.end), *(cells * RESOLUTION for cells in frame.shape)
    if length <= 0.0 or area.half_width <= 0.0:
        return None
    ux, uy = (area.end.x - area.start.x) / length, (area.end.y - area.start.y) / length
    x, y = frame.corner.x - area.start.x, frame.corner.y - area.start.y
    corners = [(x + right, y + up) for right in (0.0, width) for up in (0.0, height)]
    along, across = [cx * ux + cy * uy for cx, cy in corners], [cy * ux - cx * uy for cx, cy in corners]
    first, last = max(0.0, min(along)), min(length, max(along))
    right, left = max(-area.half_width, min(across)), min(area.half_width, max(across))
    if first >= last or right >= left:
        return None
    corner = Point(area.start.x + ux * first - uy * right, area.start.y + uy * first + ux * right)
    return _Field(corner, ux, uy, last - first, left - right)


def all_parts(areas: Sequence[Area], floor: NDArray[np.bool_], frame: GridFrame, width: float) -> list[SweptPart]:
    """Return the parts of ``areas`` on open ``floor``, with lanes along them, at most ``width`` m apart.

    Raises InvalidGoal for more than LANES_MAX lanes.
    """
    fields = [field for area in areas if (field := _field(area, frame)) is not None]
    if (count := sum(field.lanes(width) for field in fields)) > LANES_MAX:
        raise InvalidGoal(f"{width:g} m apart these areas have {count} lanes, and {LANES_MAX} are the most")
    return [part for field in fields for part in _parts(field, floor, frame, field.lanes(width))]


def _parts(field: _Field, floor: NDArray[np.bool_], frame: GridFrame, count: int) -> list[SweptPart]:
    """Return the parts of one field with ``count`` lanes."""
    ux, uy = field.ux, field.uy
    along = np.arange(0.0, field.length + RESOLUTION / 2, RESOLUTION / 2)
    growing: dict[Run, list[Stretch]] = {}  # the parts that reach the lane before, by its runs
    found: list[list[Stretch]] = []
    for lane in range(count):
        beside = field.width * (lane + 0.5) / count
        x, y = field.corner.x - uy * beside + ux * along, field.corner.y + ux * beside + uy * along
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
