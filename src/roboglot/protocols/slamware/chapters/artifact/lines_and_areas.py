"""Chapter "artifact": virtual walls and tracks, rectangular areas, laser landmarks."""

from __future__ import annotations

from dataclasses import replace

from roboglot.model.components.mapping.annotations import Annotations, MapAnnotations
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.artifact.drawing import (
    AREA_KINDS,
    LINE_KINDS,
    area_of,
    line_of,
    wire_area,
    wire_line,
)
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters import artifact as wire
from roboglot.wire.slamware.chapters.artifact import AreaChange, AreaRequest, AreaUsage, Lines, LineUsage, RectangleArea

API = "/api/core/artifact/v1"
LINES, AREAS = f"{API}/lines/{{usage}}", f"{API}/rectangle-areas/{{usage}}"


def _settings(metadata: wire.Metadata) -> dict[str, str]:
    """Return an area's new metadata as text. Raises InvalidGoal for values that no robot can follow."""
    text = wire.metadata_text(metadata)
    try:
        wire.check_settings(text)
    except wire.MetadataError as error:
        raise InvalidGoal(str(error)) from None
    return text


@TABLE.on(f"GET {LINES}", right=Right.SEE, needs=(MapAnnotations,))
def get_lines(context: Context, usage: LineUsage) -> list[wire.Line]:
    """Return all lines of one kind, oldest first."""
    return [wire_line(line) for line in context.robot[MapAnnotations].current.lines_of(LINE_KINDS[usage])]


@TABLE.on(f"POST {LINES}", right=Right.EDIT, needs=(MapAnnotations,))
async def add_lines(context: Context, usage: LineUsage, body: Lines) -> bool:
    """Add lines; ids in the body are ignored."""
    lines = [line_of(LINE_KINDS[usage], line) for line in body]
    await context.robot[MapAnnotations].change(lambda now: now.with_new(*lines))
    return True


@TABLE.on(f"PUT {LINES}", right=Right.EDIT, needs=(MapAnnotations,))
async def modify_lines(context: Context, usage: LineUsage, body: Lines) -> bool:
    """Change lines by id; 404 without any change if one of them does not exist."""
    changed = {line.id: line_of(LINE_KINDS[usage], line) for line in body}

    def edit(now: Annotations) -> Annotations:
        known = {line.id for line in now.lines_of(LINE_KINDS[usage])}
        if missing := changed.keys() - known:
            raise NotFound(f"there are no {usage} with the ids {sorted(missing)[:20]}")
        return replace(now, lines=tuple(changed.get(line.id, line) for line in now.lines))

    await context.robot[MapAnnotations].change(edit)
    return True


@TABLE.on(f"DELETE {LINES}", right=Right.EDIT, needs=(MapAnnotations,))
async def clear_lines(context: Context, usage: LineUsage) -> bool:
    """Remove all lines of one kind."""
    kind = LINE_KINDS[usage]
    await context.robot[MapAnnotations].change(
        lambda now: replace(now, lines=tuple(line for line in now.lines if line.kind is not kind))
    )
    return True


@TABLE.on(f"DELETE {LINES}/{{id}}", right=Right.EDIT, needs=(MapAnnotations,))
async def remove_line_by_id(context: Context, usage: LineUsage, id: int) -> bool:
    """Remove a line; 404 if there is none."""
    kind = LINE_KINDS[usage]

    def edit(now: Annotations) -> Annotations:
        left = tuple(line for line in now.lines if line.kind is not kind or line.id != id)
        if len(left) == len(now.lines):
            raise NotFound(f"there are no {usage} with the id {id}")
        return replace(now, lines=left)

    await context.robot[MapAnnotations].change(edit)
    return True


@TABLE.on(f"GET {AREAS}", right=Right.SEE, needs=(MapAnnotations,))
def get_rectangle_areas(context: Context, usage: AreaUsage) -> list[RectangleArea]:
    """Return all areas of one kind, oldest first."""
    return [wire_area(area) for area in context.robot[MapAnnotations].current.areas_of(AREA_KINDS[usage])]


@TABLE.on(f"POST {AREAS}", right=Right.EDIT, needs=(MapAnnotations,))
async def add_rectangle_area(context: Context, usage: AreaUsage, body: AreaRequest) -> bool:
    """Add an area; the settings in its metadata must be valid."""
    area = area_of(usage, body.area, _settings(body.metadata))
    await context.robot[MapAnnotations].change(lambda now: now.with_new(area))
    return True


@TABLE.on(f"DELETE {AREAS}", right=Right.EDIT, needs=(MapAnnotations,))
async def clear_rectangle_areas(context: Context, usage: AreaUsage) -> bool:
    """Remove all areas of one kind."""
    kind = AREA_KINDS[usage]
    await context.robot[MapAnnotations].change(
        lambda now: replace(now, areas=tuple(area for area in now.areas if area.kind is not kind))
    )
    return True


@TABLE.on(f"PUT {AREAS}/{{id}}", right=Right.EDIT, needs=(MapAnnotations,))
async def edit_rectangle_area(context: Context, usage: AreaUsage, id: int, body: AreaChange) -> bool:
    """Change an area's place, metadata or both; 404 if there is none."""

    def edit(now: Annotations) -> Annotations:
        old = next((area for area in now.areas_of(AREA_KINDS[usage]) if area.id == id), None)
        if old is None:
            raise NotFound(f"there is no {usage} {id}")
        rectangle = body.area or wire_area(old).area
        metadata = dict(old.metadata) if body.metadata is None else _settings(body.metadata)
        new = area_of(usage, rectangle, metadata, id)
        return replace(now, areas=tuple(new if area is old else area for area in now.areas))

    await context.robot[MapAnnotations].change(edit)
    return True


@TABLE.on(f"DELETE {AREAS}/{{id}}", right=Right.EDIT, needs=(MapAnnotations,))
async def remove_rectangle_area_by_id(context: Context, usage: AreaUsage, id: int) -> bool:
    """Remove an area; 404 if there is none."""
    kind = AREA_KINDS[usage]

    def edit(now: Annotations) -> Annotations:
        left = tuple(area for area in now.areas if area.kind is not kind or area.id != id)
        if len(left) == len(now.areas):
            raise NotFound(f"there is no {usage} {id}")
        return replace(now, areas=left)

    await context.robot[MapAnnotations].change(edit)
    return True
