"""Translation of lines and areas between API and model. Knows no socket and no robot."""

from __future__ import annotations

import contextlib
from dataclasses import replace

from roboglot.model.components.mapping.annotations import Area, AreaKind, Line, LineKind
from roboglot.model.components.mapping.map_memory import Drawings
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Point, Pose
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
    metadata: wire.Metadata = dict(metadata_of(line))
    return wire.Line(_wire_point(line.start), _wire_point(line.end), line.id, metadata)


def metadata_of(line: Line) -> dict[str, str]:
    """Return the line's metadata, with the text of its control points updated: the model moves only the points."""
    metadata = dict(line.metadata)
    if line.control is None:
        return metadata
    with contextlib.suppress(MetadataError):
        written = wire.control_points(metadata)
        if written is not None and tuple(map(_point, written)) == line.control:
            return metadata  # as it came
    first, second = line.control
    return wire.with_control_points(metadata, (first.x, first.y), (second.x, second.y))


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
    """Return all drawings, and what their metadata say, in the map's frame after its origin has moved."""
    seen = drawn.seen_from(origin)
    lines = tuple(replace(line, metadata=metadata_of(line)) for line in seen.annotations.lines)
    return replace(seen, annotations=replace(seen.annotations, lines=lines))


def _point(point: geometry.Point) -> Point:
    return Point(point.x, point.y)


def _wire_point(point: Point) -> geometry.Point:
    return geometry.Point(point.x, point.y)
