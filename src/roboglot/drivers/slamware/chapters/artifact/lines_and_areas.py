"""The virtual walls, tracks and rectangular areas of a Slamware robot."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Hashable, Mapping, Sequence

from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.drivers.local_entries import Drawing, key_of, without_id
from roboglot.model.components.mapping.annotations import Area, AreaKind, Line, LineKind
from roboglot.model.geometry import Point
from roboglot.wire.slamware import geometry
from roboglot.wire.slamware.chapters import artifact as wire
from roboglot.wire.slamware.chapters.artifact import AreaUsage, LineUsage, MetadataError

Usage = LineUsage | AreaUsage
LINES = {LineUsage.WALLS: LineKind.WALL, LineUsage.TRACKS: LineKind.TRACK}
AREAS = {usage: AreaKind[usage.name] for usage in AreaUsage}
USAGES: Sequence[Usage] = (*LINES, *AREAS)
SPEED_MAX, ESCAPE_MAX, ROBOTS_MAX = 100.0, 1000.0, 1000.0  # m/s, m, robots


class SlamwareDrawings:
    """``artifact/v1/lines`` and ``rectangle-areas``. Usages that the firmware lacks are not polled again."""

    def __init__(self, client: SlamwareClient) -> None:
        self._client = client
        self._has: dict[Usage, bool] = {}
        self._ids: dict[Hashable, tuple[Usage, int]] = {}

    async def read(self) -> Mapping[Hashable, Drawing]:
        """Return all drawings; invalid ones are left out."""
        found: dict[Hashable, Drawing] = {}
        ids: dict[Hashable, tuple[Usage, int]] = {}
        for usage in USAGES:
            for id, drawing in await self._entries(usage):
                key = key_of(bare := without_id(drawing))
                found[key], ids[key] = bare, (usage, id)
        self._ids = ids
        return found

    async def write(self, put: Sequence[Drawing], gone: Sequence[Drawing]) -> Collection[Hashable]:
        """Apply the changes one by one; return the keys of refused drawings."""
        refused = set()
        for drawing in put:
            try:
                await self._add(drawing)
            except SlamwareRefused:
                refused.add(key_of(drawing))
        for key in map(key_of, gone):
            with contextlib.suppress(SlamwareRefused):  # already gone
                await self._remove(*self._ids[key])
        return refused

    async def _entries(self, usage: Usage) -> Sequence[tuple[int, Drawing]]:
        if not self._has.get(usage, True):
            return ()
        try:
            if isinstance(usage, LineUsage):
                lines = await self._client.get_lines(usage)
                self._has[usage] = True
                return [(line.id, drawn) for line in lines if (drawn := line_of(usage, line))]
            areas = await self._client.get_rectangle_areas(usage)
        except SlamwareRefused:
            if usage in self._has:
                raise
            self._has[usage] = False
            return ()
        self._has[usage] = True
        return [(area.id, rectangle) for area in areas if (rectangle := area_of(usage, area))]

    async def _add(self, drawing: Drawing) -> None:
        metadata: wire.Metadata = dict(drawing.metadata)
        start, end = (geometry.Point(point.x, point.y) for point in (drawing.start, drawing.end))
        if isinstance(drawing, Line):
            usage = next(usage for usage, kind in LINES.items() if kind is drawing.kind)
            await self._client.add_lines(usage, [wire.Line(start, end, 0, metadata)])
        else:
            rectangle = wire.Strip(start, end, drawing.half_width)
            request = wire.AreaRequest(rectangle, metadata)
            await self._client.add_rectangle_area(AreaUsage[drawing.kind.name], request)

    async def _remove(self, usage: Usage, id: int) -> None:
        if isinstance(usage, LineUsage):
            await self._client.remove_line_by_id(usage, id)
        else:
            await self._client.remove_rectangle_area_by_id(usage, id)


def line_of(usage: LineUsage, line: wire.Line) -> Line | None:
    """Return the line, or None if its metadata are invalid."""
    metadata = wire.metadata_text(line.metadata)
    try:
        control = wire.control_points(metadata)
    except MetadataError:
        return None
    curve = (_point(control[0]), _point(control[1])) if control else None
    return Line(0, LINES[usage], _point(line.start), _point(line.end), curve, metadata)


def area_of(usage: AreaUsage, area: wire.RectangleArea) -> Area | None:
    """Return the area, or None if its metadata are invalid."""
    metadata, rectangle = area.metadata, area.area
    try:
        robots = wire.number(metadata, "restricted_robots_number_limit", ROBOTS_MAX)
        return Area(
            0, AREAS[usage], _point(rectangle.start), _point(rectangle.end), rectangle.half_width,
            speed_max=wire.number(metadata, "max_line_speed", SPEED_MAX),
            escape=wire.number(metadata, "escape_distance", ESCAPE_MAX),
            sensors=wire.sensor_types(metadata), robots_max=None if robots is None else int(robots), metadata=metadata,
        )  # fmt: skip
    except MetadataError:
        return None


def _point(point: geometry.Point) -> Point:
    return Point(point.x, point.y)
