"""Translation of lines and areas between API and model. Knows no socket and no robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from roboglot.model.components.mapping.annotations import Area, AreaKind, Line, LineKind
from roboglot.model.components.mapping.map_memory import Drawings
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import PointOfInterest
from roboglot.wire.slamware import geometry
from roboglot.wire.slamware.chapters import artifact as wire
from roboglot.wire.slamware.chapters.artifact import AreaUsage, LineUsage, MetadataError

SPEED_MAX, ESCAPE_MAX, ROBOTS_MAX = 100.0, 1000.0, 1000.0  # m/s, m, robots

LINE_KINDS = {LineUsage.WALLS: LineKind.WALL, LineUsage.TRACKS: LineKind.TRACK}
AREA_KINDS = {usage: AreaKind[usage.name] for usage in AreaUsage}
AREA_USAGES = {kind: usage for usage, kind in AREA_KINDS.items()}


def line_of(kind: LineKind, line: wire.Line) -> Line:
    """Return the model's line. Raises InvalidGoal for malformed control points."""
    metadata = wire.metadata_text(line.metadata)
    try:
        control = wire.control_points(metadata)
    except MetadataError as error:
        raise InvalidGoal(str(error)) from None
    curve = (_point(control[0]), _point(control[1])) if control else None
    return Line(line.id, kind, _point(line.start), _point(line.end), curve, metadata)


def wire_line(line: Line) -> wire.Line:
    """Return the line as the API writes it."""
    return wire.Line(_wire_point(line.start), _wire_point(line.end), line.id, dict(line.metadata))


def area_of(usage: AreaUsage, rectangle: wire.Strip, metadata: dict[str, str], id: int = 0) -> Area:
    """Return the model's area, with the settings in its metadata. Raises InvalidGoal for malformed values."""
    try:
        robots = wire.number(metadata, "restricted_robots_number_limit", ROBOTS_MAX)
        return Area(
            id,
            AREA_KINDS[usage],
            _point(rectangle.start),
            _point(rectangle.end),
            rectangle.half_width,
            speed_max=wire.number(metadata, "max_line_speed", SPEED_MAX),
            escape=wire.number(metadata, "escape_distance", ESCAPE_MAX),
            sensors=wire.sensor_types(metadata),
            robots_max=None if robots is None else int(robots),
            metadata=metadata,
        )
    except MetadataError as error:
        raise InvalidGoal(str(error)) from None


def wire_area(area: Area) -> wire.RectangleArea:
    """Return the area as the API writes it."""
    rectangle = wire.Strip(_wire_point(area.start), _wire_point(area.end), area.half_width)
    return wire.RectangleArea(area.id, AREA_USAGES[area.kind], rectangle, dict(area.metadata))


def seen_from(origin: Pose, drawn: Drawings) -> Drawings:
    """Return all drawings in the map's frame after its origin has moved to ``origin``."""

    def point(p: Point) -> Point:
        return Pose(p.x, p.y).relative_to(origin).point

    def marks(all: Sequence[PointOfInterest]) -> tuple[PointOfInterest, ...]:
        return tuple(replace(mark, pose=mark.pose.relative_to(origin)) for mark in all)

    def moved(line: Line) -> Line:
        line = replace(line, start=point(line.start), end=point(line.end))
        if line.control is None:
            return line
        first, second = map(point, line.control)
        metadata = wire.with_control_points(dict(line.metadata), (first.x, first.y), (second.x, second.y))
        return replace(line, control=(first, second), metadata=metadata)

    notes = drawn.annotations
    lines = map(moved, notes.lines)
    areas = [replace(area, start=point(area.start), end=point(area.end)) for area in notes.areas]
    annotations = replace(
        notes, lines=tuple(lines), areas=tuple(areas), docks=marks(notes.docks), landmarks=marks(notes.landmarks)
    )
    return Drawings(marks(drawn.places), annotations)


def _point(point: geometry.Point) -> Point:
    return Point(point.x, point.y)


def _wire_point(point: Point) -> geometry.Point:
    return geometry.Point(point.x, point.y)
