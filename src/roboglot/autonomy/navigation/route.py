"""A planned way for the follower: dense points, their speed limits, and the goals' places on it."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.centering import sideways
from roboglot.autonomy.navigation.speed_profile import BRAKING_SHARE
from roboglot.model.geometry import Path, Point, Pose, wrap_angle

SPACING = 0.05  # m between two points
CORNER_REACH = 5  # points before and after between which a bend is measured
SIDEWAYS_ACCELERATION = 0.6  # m/s2 in bends
PASSED = 0.05  # m from an intermediate goal that count as reached, at most
PASSED_BESIDE = 0.025  # m from the point where the route passes an occupied goal
CENTRED = 30  # points ahead that are centred in gaps
GOAL_KEPT = 0.2  # m around a goal that are not centred
SEARCH_AHEAD = 40  # points among which the nearest is searched

Floats = NDArray[np.float64]


class Route:
    """``points`` (n, 2; map, m), ``along`` (n): m from the start, ``speeds`` (n): limits, m/s.

    ``goals``: places where the route passes them; ``reaches``: m from there that count as passed.
    """

    def __init__(self, legs: Sequence[Floats], wanted: Sequence[Point] | None = None, tolerance: float = 0.1) -> None:
        """``legs``: for each goal, the vertices up to it (m, 2), at least one.

        ``wanted``: the goals themselves, as a leg may end a little beside an occupied one. Half of ``tolerance`` (m) is
        kept for the uncertainty of the pose.
        """
        from roboglot.kernels.obstacles import nearest_point, way_ahead  # they need Numba

        self._nearest_point: Callable[[Floats, int, int, float, float], tuple[int, float]] = nearest_point
        self._way_ahead: Callable[[Floats, int, int, float, float, float, float, int], Floats] = way_ahead
        self.vertices = np.concatenate(legs)
        self.points, self.along, places = _densified(self.vertices)
        ends = np.cumsum([len(leg) for leg in legs]) - 1
        self.vertices_along = self.along[places]
        self.goals_along: list[float] = self.vertices_along[ends].tolist()
        self.goals: list[Point] = [Point(x, y) for x, y in self.vertices[ends].tolist()]
        pairs = zip(self.goals, wanted or self.goals, strict=True)
        reach = min(PASSED, max(PASSED_BESIDE, tolerance / 2))
        self.reaches = [reach if end.distance_to(goal) < 1e-6 else PASSED_BESIDE for end, goal in pairs]
        self._goals_at: list[int] = places[ends].tolist()  # indices into the points
        self.speeds: Floats = np.zeros(len(self.points))
        self.unknown = 0.0  # m over floor that was never seen
        self.ends_known = False  # whether the map knows the floor at all goals
        self._ceilings: Floats = np.zeros(len(self.points))
        self.end = self.goals[-1]
        self.length = float(self.along[-1])  # m
        self._at = 0
        self._planned = self.points.copy()
        self._moved_to = 0  # points from there on are as planned

    # For single look-ups; most plans are never driven.
    @cached_property
    def _marks(self) -> list[float]:
        found: list[float] = self.along.tolist()
        return found

    @cached_property
    def _spots(self) -> list[list[float]]:
        found: list[list[float]] = self.points.tolist()
        return found

    @cached_property
    def _corners(self) -> list[Point]:
        return [Point(x, y) for x, y in self.vertices.tolist()]

    @cached_property
    def _corners_along(self) -> list[float]:
        found: list[float] = self.vertices_along.tolist()
        return found

    def set_speeds(self, ceilings: Floats, acceleration: float) -> None:
        """Set the speed limits: ``ceilings`` (n; m/s), less in bends, and braking in time for those and the end."""
        bends = np.zeros(len(self.points))
        if len(self.points) > 2 * CORNER_REACH:
            ahead = self.points[2 * CORNER_REACH :] - self.points[CORNER_REACH:-CORNER_REACH]
            behind = self.points[CORNER_REACH:-CORNER_REACH] - self.points[: -2 * CORNER_REACH]
            cross = behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0]
            bends[CORNER_REACH:-CORNER_REACH] = np.abs(np.arctan2(cross, (behind * ahead).sum(axis=1)))
        self._ceilings = ceilings
        for place in self._goals_at:
            bends[place] = max(bends[place], self._bend(place))
        radii = CORNER_REACH * SPACING / np.maximum(bends, 1e-3)
        allowed = np.minimum(ceilings, np.sqrt(SIDEWAYS_ACCELERATION * radii))
        allowed[-1] = 0.0
        # v^2 + 2 a s must not grow towards the start: a running minimum from the end.
        energy = allowed**2 + 2.0 * BRAKING_SHARE * acceleration * self.along
        lowest = np.minimum.accumulate(energy[::-1])[::-1]
        self.speeds = np.sqrt(np.maximum(0.0, lowest - 2.0 * BRAKING_SHARE * acceleration * self.along))

    def centre(self, echoes: Floats, clearance: float) -> tuple[float, bool]:
        """Move the next stretch to the middle of gaps with less than ``clearance`` (m) on both sides.

        ``echoes`` (n, 2; map, m): present obstacles. Goals keep their places. Returns the narrowest gap's width (m; inf
        if there is none), and whether points may have moved.
        """
        stretch = slice(self._at, min(self._at + CENTRED, len(self.points)))
        way = self._planned[stretch]
        shift, width = sideways(way, echoes, clearance)
        if math.isinf(width) and self._at >= self._moved_to:
            return width, False
        self._moved_to = 0 if math.isinf(width) else stretch.stop
        begin, far = Point(*way[0].tolist()), CENTRED * SPACING + GOAL_KEPT
        for goal in (goal for goal in self.goals if begin.distance_to(goal) <= far):
            shift[np.hypot(way[:, 0] - goal.x, way[:, 1] - goal.y) < GOAL_KEPT] = 0.0
        self.points[stretch] = way + shift
        self._spots[stretch] = self.points[stretch].tolist()
        return width, True

    def _bend(self, place: int) -> float:
        """Return the turn (rad, >= 0) at a point of the route."""
        if not 0 < place < len(self.points) - 1:
            return 0.0
        before, here, behind = (Point(x, y) for x, y in self.points[place - 1 : place + 2].tolist())
        return abs(wrap_angle(here.bearing_to(behind) - before.bearing_to(here)))

    def advance(self, pose: Pose, goal: int) -> tuple[float, float]:
        """Advance to the point nearest to ``pose``; return the distances along the way and beside it, m.

        Never goes back, and never past ``goal`` (a number), as the way after it may cross the way to it.
        """
        end = min(self._at + SEARCH_AHEAD, self._goals_at[goal] + 1)
        self._at, away = self._nearest_point(self.points, self._at, end, pose.x, pose.y)
        return self._marks[self._at], away

    @property
    def speed_here(self) -> float:
        """Speed limit at the present point, m/s."""
        return float(self.speeds[self._at])

    @property
    def ceiling_here(self) -> float:
        """Speed limit at the present point without braking for bends and the end, m/s."""
        return float(self._ceilings[self._at])

    def point_at(self, along: float) -> Point:
        """Return the first dense point at or after ``along`` m."""
        x, y = self._spots[min(bisect_left(self._marks, along), len(self._marks) - 1)]
        return Point(x, y)

    def ahead(self, pose: Pose, carrot: Point, beyond: float, horizon: float) -> Floats:
        """Return the way ahead (dense; map): straight to ``carrot``, then ``horizon`` m of route from ``beyond`` m."""
        first = bisect_left(self._marks, beyond)
        last = min(bisect_left(self._marks, beyond + horizon) + 1, len(self._marks))
        count = math.ceil(math.hypot(carrot.x - pose.x, carrot.y - pose.y) / SPACING)
        return self._way_ahead(self.points, first, last, pose.x, pose.y, carrot.x, carrot.y, count)

    def remaining(self, pose: Pose, along: float) -> Path:
        """Return the remaining vertices, beginning with ``pose``."""
        first = min(bisect_right(self._corners_along, along + SPACING), len(self._corners) - 1)
        return Path((pose.point, *self._corners[first:]))


def _densified(vertices: Floats) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return points at most SPACING m apart along the polyline, their distances (m), and the vertices' indices."""
    ahead = np.diff(vertices, axis=0)
    counts, spans, gone, begins, places = [], [], 0.0, [], [0]
    for x, y in ahead.tolist():
        length = math.hypot(x, y)
        count = math.ceil(length / SPACING)
        counts.append(count)
        spans.append(length)
        begins.append(gone)
        places.append(places[-1] + count)
        gone += length
    piece = np.repeat(np.arange(len(counts)), np.array(counts, np.int64))
    number = np.arange(1, len(piece) + 1) - np.array(places)[piece]
    shares = number / np.array(counts)[piece]
    points = vertices[:-1][piece] + shares[:, None] * ahead[piece]
    along = np.array(begins)[piece] + shares * np.array(spans)[piece]
    return np.concatenate([vertices[:1], points]), np.concatenate([np.zeros(1), along]), np.array(places)
