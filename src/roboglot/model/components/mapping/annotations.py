"""Annotations of the map: walls, tracks, areas, docks and landmarks. Acknowledged changes survive a crash."""

from __future__ import annotations

import itertools
import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from enum import StrEnum

from roboglot.model.components.component import Component
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import PointOfInterest
from roboglot.values import dataclass

LINES_MAX, AREAS_MAX, MARKS_MAX = 10_000, 2_000, 2_000
POINTS_MAX = 100_000  # of all lines: 10 km of curves
CURVE_STEP = 0.1  # m between the points that make up a curve
CURVE_POINTS_MAX = 1000


class LineKind(StrEnum):
    """Meaning of a line: a wall that must not be crossed, or a track to drive on."""

    WALL = "wall"
    TRACK = "track"


class AreaKind(StrEnum):
    """Meaning of an area."""

    FORBIDDEN = "forbidden"  # robots may not enter; one that is inside may leave, unless deeper than ``escape``
    ELEVATOR = "elevator"
    DANGEROUS = "dangerous"  # not faster than ``speed_max``
    COVERAGE = "coverage"  # to be swept or disinfected
    MAINTENANCE = "maintenance"  # if there are any, the map changes only inside them
    SENSOR_DISABLE = "sensor disable"  # readings of ``sensors`` are ignored inside
    RESTRICTED = "restricted"  # at most ``robots_max`` robots at a time


@dataclass(frozen=True, slots=True)
class Line:
    """From ``start`` to ``end`` (map, m): straight, or a cubic Bézier curve with two ``control`` points.

    ``metadata`` is free text by key, kept as it came.
    """

    id: int
    kind: LineKind
    start: Point
    end: Point
    control: tuple[Point, Point] | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)

    def points(self) -> tuple[Point, ...]:
        """Return the polyline: both ends, and points between them on a curve."""
        if self.control is None:
            return (self.start, self.end)
        corners, steps = (self.start, *self.control, self.end), self.count() - 1
        return tuple(_on_curve(corners, step / steps) for step in range(steps + 1))

    def count(self) -> int:
        """Return the number of points."""
        if self.control is None:
            return 2
        length = sum(a.distance_to(b) for a, b in itertools.pairwise((self.start, *self.control, self.end)))
        return min(max(math.ceil(length / CURVE_STEP), 2), CURVE_POINTS_MAX) + 1


def _on_curve(corners: tuple[Point, Point, Point, Point], t: float) -> Point:
    weights = ((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3)
    return Point(
        sum(w * p.x for w, p in zip(weights, corners, strict=True)),
        sum(w * p.y for w, p in zip(weights, corners, strict=True)),
    )


@dataclass(frozen=True, slots=True)
class Area:
    """A rectangle (map, m): ``half_width`` to both sides of the centre line from ``start`` to ``end``.

    ``speed_max`` in m/s; ``escape``: m inwards from the border from which a robot may still leave a forbidden area;
    ``sensors``: words of ``SensorKind`` or "sonar". ``metadata`` is free text by key, kept as it came.
    """

    id: int
    kind: AreaKind
    start: Point
    end: Point
    half_width: float
    speed_max: float | None = None
    escape: float | None = None
    sensors: frozenset[str] = frozenset()
    robots_max: int | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)

    def contains(self, point: Point | Pose) -> bool:
        """True if ``point`` lies inside or on the border."""
        return self.depth(point) >= 0.0

    def depth(self, point: Point | Pose) -> float:
        """Return the distance (m) inwards from the border to ``point``; negative outside."""
        along = math.hypot(self.end.x - self.start.x, self.end.y - self.start.y)
        dx, dy = point.x - self.start.x, point.y - self.start.y
        if along == 0.0:
            return 0.0 if dx == dy == 0.0 else -math.hypot(dx, dy)
        ux, uy = (self.end.x - self.start.x) / along, (self.end.y - self.start.y) / along
        ahead = dx * ux + dy * uy
        return min(ahead, along - ahead, self.half_width - abs(dy * ux - dx * uy))

    def corners(self) -> tuple[Point, Point, Point, Point]:
        """Return the corners counter-clockwise, from the one to the right of ``start``."""
        along = self.start.distance_to(self.end) or 1.0
        ux, uy = (self.end.x - self.start.x) / along, (self.end.y - self.start.y) / along
        wx, wy = -uy * self.half_width, ux * self.half_width
        ends = ((self.start, -1), (self.end, -1), (self.end, 1), (self.start, 1))
        first, second, third, fourth = (Point(p.x + side * wx, p.y + side * wy) for p, side in ends)
        return first, second, third, fourth


@dataclass(frozen=True, slots=True)
class Annotations:
    """A snapshot of all annotations. ``docks`` and ``landmarks``: poses with an id; ``last_id`` is never reused."""

    lines: tuple[Line, ...] = ()
    areas: tuple[Area, ...] = ()
    docks: tuple[PointOfInterest, ...] = ()
    landmarks: tuple[PointOfInterest, ...] = ()
    last_id: int = 0

    def lines_of(self, kind: LineKind) -> tuple[Line, ...]:
        """Return those of one kind, oldest first."""
        return tuple(line for line in self.lines if line.kind is kind)

    def areas_of(self, kind: AreaKind) -> tuple[Area, ...]:
        """Return those of one kind, oldest first."""
        return tuple(area for area in self.areas if area.kind is kind)

    def check_limits(self, before: Annotations | None = None) -> None:
        """Raise InvalidGoal for more than a robot can use at a time, unless there is no more than ``before``."""
        sizes, most = self._sizes(), before._sizes() if before else {}
        for what, limit in (("lines", LINES_MAX), ("areas", AREAS_MAX), ("docks", MARKS_MAX), ("landmarks", MARKS_MAX)):
            if sizes[what] > max(limit, most.get(what, 0)):
                raise InvalidGoal(f"more than {limit} {what}")
        if sizes["points"] > max(POINTS_MAX, most.get("points", 0)):
            raise InvalidGoal(f"the lines have more than {POINTS_MAX} points, of which a curve has ten a metre")

    def _sizes(self) -> dict[str, int]:
        return {
            "lines": len(self.lines),
            "areas": len(self.areas),
            "docks": len(self.docks),
            "landmarks": len(self.landmarks),
            "points": sum(line.count() for line in self.lines),
        }

    def with_new(self, *entries: Line | Area) -> Annotations:
        """Return a copy with further annotations, which get new ids."""
        fresh = [replace(entry, id=self.last_id + number) for number, entry in enumerate(entries, 1)]
        return replace(
            self,
            lines=(*self.lines, *(entry for entry in fresh if isinstance(entry, Line))),
            areas=(*self.areas, *(entry for entry in fresh if isinstance(entry, Area))),
            last_id=self.last_id + len(fresh),
        )


class MapAnnotations(Component):
    """The annotations of the map in use; navigation obeys them. Publishes ``AnnotationsChanged``."""

    @property
    @abstractmethod
    def current(self) -> Annotations:
        """Current annotations: a value, so a change is a change of identity."""

    @abstractmethod
    async def change(self, edit: Callable[[Annotations], Annotations]) -> None:
        """Replace the current annotations by ``edit`` of them, serialized; return once they are on disk.

        An error of ``edit`` is raised and nothing changes. Raises what ``Annotations.check_limits`` does.
        """
