"""Local side of an EntrySync: places by id; lines and areas by content, as each side numbers them on its own."""

from __future__ import annotations

import logging
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from roboglot.model.components.mapping.annotations import Annotations, Area, Line, MapAnnotations
from roboglot.model.components.mapping.places import Places
from roboglot.model.errors import RobotError
from roboglot.model.geometry import Point
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot

log = logging.getLogger(__name__)
Drawing = Line | Area
Keys = Mapping[Hashable, Hashable]
DIGITS = 3  # of a coordinate in m; smaller differences are ignored
SAME = 0.005  # m by which distances between rounded points may differ


class LocalPlaces:
    """Entries of ``Places``, by id."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._known: dict[Hashable, PointOfInterest] = {}  # when they were read last

    async def read(self) -> Mapping[Hashable, PointOfInterest]:
        """Return all places."""
        self._known = {place.id: place for place in self._robot[Places].all()}
        return self._known

    @staticmethod
    def moves(before: Mapping[Hashable, PointOfInterest], now: Mapping[Hashable, PointOfInterest]) -> Keys:
        """Return the ids of places that are elsewhere now and the same otherwise."""
        return {
            id: id
            for id, place in before.items()
            if (there := now.get(id)) not in (None, place) and replace(there, pose=place.pose) == place
        }

    @staticmethod
    def merge(here: PointOfInterest, before: PointOfInterest, there: PointOfInterest) -> PointOfInterest | None:
        """Return the place with what was edited here, where the robot moved it; None if it was moved here, too."""
        return replace(here, pose=there.pose) if here.pose == before.pose else None

    async def write(self, put: Sequence[PointOfInterest], gone: Sequence[PointOfInterest]) -> Collection[Hashable]:
        """Apply all changes at once, but to places that have changed since they were read; log a failure."""
        known = self._known

        def edit(now: Sequence[PointOfInterest]) -> Sequence[PointOfInterest]:
            places: dict[Hashable, PointOfInterest] = {place.id: place for place in now}
            for place in put:
                if places.get(place.id) == known.get(place.id):  # else a removal or edit here was under way
                    places[place.id] = place
            for place in gone:
                if places.get(place.id) == known.get(place.id):
                    places.pop(place.id, None)
            return tuple(places.values())

        try:
            await self._robot[Places].change(edit)
        except RobotError as error:  # too many
            log.warning("cannot store places of robot %s: %s", self._robot.id, error)
        return ()


class LocalDrawings:
    """Lines and areas of ``MapAnnotations``, by content."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._known: Mapping[Hashable, Drawing] = {}  # when they were read last

    async def read(self) -> Mapping[Hashable, Drawing]:
        """Return all drawings, without ids."""
        self._known = _drawn(self._robot[MapAnnotations].current)
        return self._known

    @staticmethod
    def moves(before: Mapping[Hashable, Drawing], now: Mapping[Hashable, Drawing]) -> Keys:
        """Return the keys of drawings before and now, of each kind that was moved as a whole, in the same order."""
        olds, news = _by_kind(before), _by_kind(now)
        found: dict[Hashable, Hashable] = {}
        for kind, old in olds.items():
            new = news.get(kind, [])
            if len(old) == len(new) and _are_moved([before[key] for key in old], [now[key] for key in new]):
                found |= zip(old, new, strict=True)
        return found

    @staticmethod
    def merge(_here: Drawing, _before: Drawing, _there: Drawing) -> None:
        """Return None: an edited drawing has another key, and counts as a new one."""

    async def write(self, put: Sequence[Drawing], gone: Sequence[Drawing]) -> Collection[Hashable]:
        """Apply all changes at once, without what was removed since it was read; log a failure."""
        lost, known = set(map(key_of, gone)), self._known
        moves = self.moves(known, {key_of(drawing): drawing for drawing in put})

        def edit(now: Annotations) -> Annotations:
            lines = tuple(line for line in now.lines if key_of(without_id(line)) not in lost)
            areas = tuple(area for area in now.areas if key_of(without_id(area)) not in lost)
            removed = {moves.get(key, key) for key in known.keys() - _drawn(now).keys()}
            new = [drawing for drawing in put if key_of(drawing) not in removed]
            return replace(now, lines=lines, areas=areas).with_new(*new)

        try:
            await self._robot[MapAnnotations].change(edit)
        except RobotError as error:
            log.warning("cannot store drawings on the map of robot %s: %s", self._robot.id, error)
        return ()


def _drawn(notes: Annotations) -> Mapping[Hashable, Drawing]:
    """Return lines and areas by content, without ids."""
    drawings: tuple[Drawing, ...] = (*notes.lines, *notes.areas)
    return {key_of(bare): bare for bare in map(without_id, drawings)}


def without_id(drawing: Drawing) -> Drawing:
    """Return the drawing with id 0 and coordinates rounded to the millimetre."""
    start, end = _rounded(drawing.start), _rounded(drawing.end)
    if isinstance(drawing, Area):
        return replace(drawing, id=0, start=start, end=end, half_width=round(drawing.half_width, DIGITS))
    return replace(drawing, id=0, start=start, end=end)


def key_of(drawing: Drawing) -> Hashable:
    """Return the key of a drawing ``without_id``."""
    width = drawing.half_width if isinstance(drawing, Area) else None
    return drawing.kind, drawing.start, drawing.end, width, frozenset(drawing.metadata.items())


def _by_kind(drawings: Mapping[Hashable, Drawing]) -> dict[Hashable, list[Hashable]]:
    """Return the keys of drawings by what a move leaves as it is."""
    found: dict[Hashable, list[Hashable]] = {}
    for key, drawing in drawings.items():
        width = drawing.half_width if isinstance(drawing, Area) else None
        found.setdefault((drawing.kind, width, frozenset(drawing.metadata.items())), []).append(key)
    return found


def _are_moved(olds: Sequence[Drawing], news: Sequence[Drawing]) -> bool:
    """Return whether all are as long, and as far from the one before, as they were."""
    points = [[point for one in drawings for point in (one.start, one.end)] for drawings in (olds, news)]
    distances = [[a.distance_to(b) for a, b in pairwise(each)] for each in points]
    return all(abs(old - new) <= SAME for old, new in zip(*distances, strict=True))


def _rounded(point: Point) -> Point:
    return Point(round(point.x, DIGITS) + 0.0, round(point.y, DIGITS) + 0.0)
