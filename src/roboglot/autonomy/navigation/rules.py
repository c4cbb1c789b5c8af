"""Annotations of the map as layers of a planning grid: closed cells, cost beside the tracks, speeds in areas.

Knows no robot; loads the kernels when it is used.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import RESOLUTION
from roboglot.model.components.mapping.annotations import Annotations, Area, AreaKind, Line, LineKind
from roboglot.model.components.motion.navigation import Tracks
from roboglot.model.geometry import Point
from roboglot.values import dataclass

WALL_HALF = 0.75 * RESOLUTION  # m beside a virtual wall that are closed, so that no diagonal passes
TRACK_HALF = 1.5 * RESOLUTION  # m beside a track that count as on it
OFF_TRACK_COST = 3.0  # extra cost of a cell beside the tracks, where they are preferred
ENTRY = 1.5  # m that may be driven off the tracks at start and goal
ENTRY_SLACK = 0.15  # m beyond the nearest point of the tracks
ENTRY_COST = 12.0
LEAVING_COST = 20.0  # inside a forbidden area that the robot is leaving
DANGEROUS_SPEED = 0.3  # m/s where an area gives none
SPEED_MIN = 0.05  # m/s: a speed limit must not stop the robot

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class GridFrame:
    """Frame of a grid: ``corner`` of cell (0, 0) in map; ``shape``: rows and columns."""

    corner: Point
    shape: tuple[int, int]

    def around(self, points: tuple[Point, ...], reach: float) -> tuple[slice, slice]:
        """Return the rows and columns within ``reach`` m of the points' bounding box."""
        corner, (height, width) = self.corner, self.shape
        if len(points) == 1:
            x, y = points[0].x, points[0].y
            rows = _cells(y - reach - corner.y, y + reach - corner.y, height)
            return rows, _cells(x - reach - corner.x, x + reach - corner.x, width)
        along, up = [point.x for point in points], [point.y for point in points]
        rows = _cells(min(up) - reach - corner.y, max(up) + reach - corner.y, height)
        return rows, _cells(min(along) - reach - corner.x, max(along) + reach - corner.x, width)

    def centres(self, rows: slice, columns: slice) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return x and y (map, m; broadcastable) of the cells' centres."""
        x = self.corner.x + (np.arange(columns.start, columns.stop) + 0.5) * RESOLUTION
        y = self.corner.y + (np.arange(rows.start, rows.stop) + 0.5) * RESOLUTION
        return x[None, :], y[:, None]

    def inside(self, area: Area) -> Mask:
        """Return the mask of the cells whose centre lies in ``area``."""
        from roboglot.kernels.distance import mark_inside

        mask = np.zeros(self.shape, bool)
        rows, columns = self.around(area.corners(), RESOLUTION)
        window = np.zeros((rows.stop - rows.start, columns.stop - columns.start), bool)
        left, bottom = (self.corner.x + columns.start * RESOLUTION, self.corner.y + rows.start * RESOLUTION)
        start, end = (np.array((point.x, point.y), np.float64) for point in (area.start, area.end))
        mark_inside(window, start, end, area.half_width, left, bottom, RESOLUTION)
        mask[rows, columns] = window
        return mask

    def beside(self, lines: tuple[Line, ...], reach: float) -> Mask:
        """Return the mask of the cells whose centre lies within ``reach`` m of one of ``lines``."""
        from roboglot.kernels.distance import mark_beside

        mask = np.zeros(self.shape, bool)
        for line in lines:
            mark_beside(mask, _polyline(line), self.corner.x, self.corner.y, RESOLUTION, reach)
        return mask

    def near(self, point: Point, reach: float) -> Mask:
        """Return the mask of the cells whose centre lies within ``reach`` m of ``point``."""
        mask = np.zeros(self.shape, bool)
        rows, columns = self.around((point,), reach)
        x, y = self.centres(rows, columns)
        mask[rows, columns] = np.hypot(x - point.x, y - point.y) <= reach
        return mask


def _cells(begin: float, end: float, count: int) -> slice:
    """Return the cells of ``count`` from ``begin`` to ``end``, m from the first one."""
    first, last = int(begin // RESOLUTION), int(end // RESOLUTION) + 1
    return slice(min(max(first, 0), count), min(max(last, 0), count))


def _polyline(line: Line) -> NDArray[np.float64]:
    """Return the points of a line (n, 2; map, m)."""
    return np.array([(point.x, point.y) for point in line.points()], np.float64)


@dataclass(frozen=True, slots=True)
class Layers:
    """Layers of cells: ``closed`` (the hull keeps clear), ``extra`` cost (inf: not entered), top ``speed`` (m/s)."""

    closed: Mask
    extra: NDArray[np.float32] | None
    speed: NDArray[np.float32] | None


def layers(
    drawn: Annotations, frame: GridFrame, tracks: Tracks, start: Point, goals: tuple[Point, ...]
) -> Layers | None:
    """Return the layers of one drive; None if there are none."""
    lines = drawn.lines_of(LineKind.TRACK) if tracks is not Tracks.FREE else ()
    if not (drawn.areas or drawn.lines_of(LineKind.WALL) or lines):
        return None
    extra = _off_tracks(lines, frame, (start, *goals), strict=tracks is Tracks.STRICT) if lines else None
    closed = frame.beside(drawn.lines_of(LineKind.WALL), WALL_HALF)
    for area in _kept_out_of(drawn):
        if area.contains(start):
            # A robot inside may leave, unless too deep; a goal inside stays unreachable unless it belongs to a lift.
            extra = np.zeros(frame.shape, np.float32) if extra is None else extra
            inside = frame.inside(area)
            extra[inside] += LEAVING_COST if area.kind is AreaKind.FORBIDDEN else 0.0
            if area.escape is not None and area.depth(start) > area.escape:
                extra[~inside] = np.inf
        elif area.kind is not AreaKind.ELEVATOR or not any(map(area.contains, goals)):
            closed |= frame.inside(area)
    return Layers(closed, extra, _speeds(drawn, frame))


def _off_tracks(
    lines: tuple[Line, ...], frame: GridFrame, points: tuple[Point, ...], *, strict: bool
) -> NDArray[np.float32]:
    """Return the extra cost off the tracks; ``strict``: only the ways between them and ``points`` leave them."""
    off = np.inf if strict else OFF_TRACK_COST
    cost: NDArray[np.float32] = np.where(frame.beside(lines, TRACK_HALF), 0.0, off).astype(np.float32)
    for point in points if strict else ():
        entry = min(ENTRY, _distance(lines, point) + ENTRY_SLACK)
        cost[frame.near(point, entry) & np.isinf(cost)] = ENTRY_COST
    return cost


def _distance(lines: tuple[Line, ...], point: Point) -> float:
    """Return the distance from ``point`` to the nearest of ``lines``, m."""
    nearest = math.inf
    for line in lines:
        way = _polyline(line) - (point.x, point.y)
        spans = np.diff(way, axis=0)
        shares = -(way[:-1] * spans).sum(axis=1) / np.maximum((spans**2).sum(axis=1), 1e-12)
        feet = way[:-1] + np.clip(shares, 0.0, 1.0)[:, None] * spans
        nearest = min(nearest, float(np.hypot(*feet.T).min()))
    return nearest


def _kept_out_of(drawn: Annotations) -> Iterator[Area]:
    for area in drawn.areas:
        forbidden = area.kind is AreaKind.RESTRICTED and area.robots_max == 0
        if forbidden or area.kind in (AreaKind.FORBIDDEN, AreaKind.ELEVATOR):
            yield area


def _speeds(drawn: Annotations, frame: GridFrame) -> NDArray[np.float32] | None:
    slow = drawn.areas_of(AreaKind.DANGEROUS)
    if not slow:
        return None
    speed = np.full(frame.shape, math.inf, np.float32)
    for area in slow:
        inside = frame.inside(area)
        limit = DANGEROUS_SPEED if area.speed_max is None else area.speed_max
        speed[inside] = np.minimum(speed[inside], max(limit, SPEED_MIN))
    return speed
