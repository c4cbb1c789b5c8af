"""File and floor that the drawings in memory come from, in settings, and the drawings of its other floors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import msgspec

from roboglot.model.components.mapping.map_memory import Drawings, MapMemory, Replacement
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.artifact.drawing import seen_from
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap

DRAWN = "slamware/drawn.json"  # the file of drawings on that map's other floors
NOT_MOVED = (0.0, 0.0)
FLOOR = "slamware.floor"  # the setting that holds the id of the floor of the drawings in memory
NO_FLOOR = ""  # its value for no floor
# The setting that holds the files on which the drawings in memory are based: by digest, the m (x, y) by which the
# origin has moved since.
BASIS = "slamware.map_origins"


async def other_drawings(robot: Robot) -> dict[str, Drawings]:
    """Return the drawings, by id, of other floors that the robot has visited since the map was loaded."""
    try:
        return msgspec.json.decode(await robot[FileStore].read(DRAWN), type=dict[str, Drawings])
    except NotFound:
        return {}


def put_aside(robot: Robot, now: Drawings, shift: Sequence[float], others: dict[str, Drawings], here: str) -> None:
    """Add memory's drawings to the ``others``, in the frame of the file's grid before its origin was moved.

    ``here``: the id of their floor, if none is stored.
    """
    if (last := robot[Settings].get(FLOOR, here)) != NO_FLOOR:
        others[last] = seen_from(Pose(-shift[0], -shift[1]), now)


async def put_drawings(robot: Robot, floor: FloorMap, basis: dict[str, Sequence[float]]) -> None:
    """Replace memory's drawings by those of the file: all or nothing."""
    await robot[MapMemory].replace(lambda _: replacement(floor, basis, {}))


def bases(robot: Robot) -> dict[str, Sequence[float]]:
    """Return the m (x, y) by which the origin has moved since each file, by digest, on which the drawings are based."""
    return dict(robot[Settings].get(BASIS, {}))


def frame_on_disk(robot: Robot) -> tuple[str, str, Sequence[float]] | None:
    """Return the digest, the floor and the origin's shift of the map in memory; None if it is not the one on disk."""
    floor, basis = robot[Settings].get(FLOOR, NO_FLOOR), bases(robot)
    if floor == NO_FLOOR or not basis:
        return None
    digest = next(iter(basis))
    return digest, floor, basis[digest]


def replacement(floor: FloorMap, basis: dict[str, Sequence[float]], drawn: dict[str, Drawings]) -> Replacement:
    """Return the ``drawn`` lines and areas of ``floor``, else those of the file; other floors keep theirs."""
    left = dict(drawn)
    here = left.pop(floor.name.map_id, Drawings(floor.places, floor.annotations))
    return Replacement(here, {BASIS: basis, FLOOR: floor.name.map_id}, {DRAWN: encoded(left)})


def with_docks(drawn: Drawings, docks: Iterable[PointOfInterest]) -> Drawings:
    """Return the drawings with other docks."""
    return replace(drawn, annotations=replace(drawn.annotations, docks=tuple(docks)))


def encoded(drawn: dict[str, Drawings]) -> bytes | None:
    """Return the content of the file ``DRAWN``; None: there is none."""
    return msgspec.json.encode(drawn) if drawn else None
