"""Our side of what is shared with a robot: places by id, lines and areas by what they are (ids are each side's own)."""

from __future__ import annotations

import logging
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import replace

from roboglot.model.components.mapping.annotations import (
    Annotations,
    Area,
    Line,
    MapAnnotations,
)
from roboglot.model.components.mapping.places import Places
from roboglot.model.errors import RobotError
from roboglot.model.geometry import Point
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot

log = logging.getLogger(__name__)
Drawing = Line | Area
DIGITS = 3  # of a coordinate in m: what differs less is the same


class LocalPlaces:
    """``Places``."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot

    async def read(self) -> Mapping[Hashable, PointOfInterest]:
        """All."""
        return {place.id: place for place in self._robot[Places].all()}

    async def write(self, put: Sequence[PointOfInterest], gone: Sequence[PointOfInterest]) -> Collection[Hashable]:
        """One after the other."""
        places = self._robot[Places]
        try:
            if put:
                await places.put(*put)
            for place in gone:
                await places.remove(place.id)
        except RobotError as error:  # too many, or somebody was faster
            log.warning("places of robot %s: %s", self._robot.id, error)
        return ()


class LocalDrawings:
    """Lines and areas of ``MapAnnotations``."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot

    async def read(self) -> Mapping[Hashable, Drawing]:
        """All, without ids."""
        now = self._robot[MapAnnotations].current
        drawings: tuple[Drawing, ...] = (*now.lines, *now.areas)
        return {key_of(bare): bare for bare in map(without_id, drawings)}

    async def write(self, put: Sequence[Drawing], gone: Sequence[Drawing]) -> Collection[Hashable]:
        """At one stroke."""
        lost = set(map(key_of, gone))

        def edit(now: Annotations) -> Annotations:
            lines = tuple(line for line in now.lines if key_of(without_id(line)) not in lost)
            areas = tuple(area for area in now.areas if key_of(without_id(area)) not in lost)
            return replace(now, lines=lines, areas=areas).with_new(*put)

        try:
            await self._robot[MapAnnotations].change(edit)
        except RobotError as error:
            log.warning("what is drawn on the map of robot %s: %s", self._robot.id, error)
        return ()


def without_id(drawing: Drawing) -> Drawing:
    """To the millimetre."""
    start, end = _rounded(drawing.start), _rounded(drawing.end)
    if isinstance(drawing, Area):
        return replace(drawing, id=0, start=start, end=end, half_width=round(drawing.half_width, DIGITS))
    return replace(drawing, id=0, start=start, end=end)


def key_of(drawing: Drawing) -> Hashable:
    """Of one ``without_id``."""
    width = drawing.half_width if isinstance(drawing, Area) else None
    return drawing.kind, drawing.start, drawing.end, width, frozenset(drawing.metadata.items())


def _rounded(point: Point) -> Point:
    return Point(round(point.x, DIGITS) + 0.0, round(point.y, DIGITS) + 0.0)
