"""Layers of a composite map, as far as publicly known: grids, lines, poses.

The vendor's encoding of rectangles and landmarks is not known. They are stored in layers of our own, as JSON; a
vendor's layer of that kind stays as it is. Every reader returns None for a layer that it does not fully understand.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, TypeVar

import msgspec

from roboglot.extras import lazy
from roboglot.values import dataclass
from roboglot.wire.slamware.chapters.slam.explore_map import CELLS_MAX, BadMap, ExploreMap
from roboglot.wire.slamware.chapters.slam.stcm import Layer, Pairs, Reader, pack_pairs, pack_text
from roboglot.wire.slamware.geometry import COORDINATE_MAX, Metres, Radians

if TYPE_CHECKING:
    import numpy as np
else:
    np = lazy("numpy")

GRID, LINES, POSES = (f"vnd.slamtec.map-layer/vnd.{kind}-map+binary" for kind in ("grid", "line", "pose"))
JSON = "vnd.roboglot.map-layer/json"
EXPLORE, WALLS, TRACKS = "explore", "virtual_walls", "virtual_tracks"
PLACES, DOCKS, AREAS, LANDMARKS = "point_of_interest", "home_dock_pose", "rectangle_area", "landmark"
T = TypeVar("T")
N = TypeVar("N", int, float)
ENTRIES_MAX = 20_000  # per layer
PAIRS_MAX = 400_000  # of all entries of a file
_ENDS, _POSE = struct.Struct("<4f"), struct.Struct("<3f")


@dataclass(frozen=True, slots=True)
class LineEntry:
    """A line from (x1, y1) to (x2, y2), m."""

    id: str
    x1: float
    y1: float
    x2: float
    y2: float
    metadata: Pairs = ()


@dataclass(frozen=True, slots=True)
class PoseEntry:
    """A pose (m, rad) with a name, which is the id of a place or dock."""

    name: str
    x: float
    y: float
    yaw: float
    metadata: Pairs = ()
    flags: int = 0


class AreaEntry(msgspec.Struct, frozen=True):
    """A rectangle around the centre line from (x1, y1) to (x2, y2), m; ``usage`` is one of the API's."""

    id: int
    usage: str
    x1: Metres
    y1: Metres
    x2: Metres
    y2: Metres
    half_width: Metres
    metadata: dict[str, str] = {}


class MarkEntry(msgspec.Struct, frozen=True):
    """A landmark: pose (m, rad) with an id."""

    id: str
    x: Metres
    y: Metres
    yaw: Radians
    metadata: dict[str, str] = {}


def _named(usage: str, kind: str, *pairs: tuple[str, str]) -> Pairs:
    return (("name", usage), ("usage", usage), ("type", kind), *pairs)


def _is(layer: Layer, usage: str, kind: str) -> bool:
    metadata = layer.metadata
    return metadata.get("usage") == usage and kind in metadata.get("type", "") and not metadata.get("compression")


def grid_layer(explored: ExploreMap, extra: Pairs = ()) -> Layer:
    """Return the grid as a layer; ``extra`` pairs name its floor."""
    height, width = explored.cells.shape
    numbers = {
        "dimension_width": width,
        "dimension_height": height,
        "origin_x": explored.x,
        "origin_y": explored.y,
        "resolution_x": explored.resolution,
        "resolution_y": explored.resolution,
    }
    pairs = tuple((key, str(value) if isinstance(value, int) else f"{value:.9g}") for key, value in numbers.items())
    return Layer(_named(EXPLORE, "vnd.slamtec.map-layer/vnd.grid-map+binary", *pairs, *extra), explored.cells.tobytes())


def is_grid(layer: Layer) -> bool:
    """Return whether the layer has a map's grid."""
    return _is(layer, EXPLORE, "grid-map")


def read_grid(layer: Layer) -> ExploreMap | None:
    """Return the explore map in ``layer``; None for another layer. Raises BadMap for a damaged one."""
    if not is_grid(layer):
        return None
    values = layer.metadata
    width, height = (_number(values, key, int) for key in ("dimension_width", "dimension_height"))
    keys = ("origin_x", "origin_y", "resolution_x", "resolution_y")
    x, y, resolution, other = (_number(values, key, float) for key in keys)
    size = len(layer.payload)
    if min(width, height) < 0 or width * height != size or max(width, height, size) > CELLS_MAX:
        raise BadMap(f"{width} x {height} cells do not make {size}")
    if not (math.hypot(x, y) <= COORDINATE_MAX and 0 < resolution < math.inf and resolution == other):
        raise BadMap(f"no map has its corner at ({x}, {y}) and cells of {resolution} x {other} m")
    return ExploreMap(x, y, resolution, np.frombuffer(layer.payload, np.int8).reshape(height, width))


def _number(values: Mapping[str, str], key: str, kind: Callable[[str], N]) -> N:
    try:
        return kind(values[key])
    except (KeyError, ValueError):
        raise BadMap(f"the grid's {key} is missing or no {'whole ' if kind is int else ''}number") from None


def line_layer(usage: str, lines: list[LineEntry]) -> Layer:
    """Return the layer of walls or tracks."""
    entries = (
        pack_text(line.id) + _ENDS.pack(line.x1, line.y1, line.x2, line.y2) + pack_pairs(line.metadata)
        for line in lines
    )
    return Layer(_named(usage, LINES, ("count", str(len(lines)))), b"".join(entries))


class TooManyPairs(BadMap):
    """A file's entries have more metadata than anyone could mean; unlike a strange layer, it is read no further."""


class Budget:
    """Number of pairs that the entries of one file may still have."""

    def __init__(self) -> None:
        self._left = PAIRS_MAX

    def pairs(self, reader: Reader) -> Pairs:
        """Read an entry's pairs. Raises BadMap, TooManyPairs."""
        pairs = reader.pairs()
        self.take(len(pairs))
        return pairs

    def take(self, count: int) -> None:
        """Count further pairs. Raises TooManyPairs."""
        self._left -= count
        if self._left < 0:
            raise TooManyPairs(f"places and lines have more than {PAIRS_MAX} pairs of metadata")


def read_lines(layer: Layer, usage: str, budget: Budget) -> list[LineEntry] | None:
    """Return the lines in ``layer``; None for another layer or encoding. Raises TooManyPairs."""
    if not _is(layer, usage, "line-map"):
        return None
    reader, lines = Reader(layer.payload), []
    try:
        while reader.at < len(layer.payload):
            id, (x1, y1, x2, y2) = reader.text(), _ENDS.unpack(reader.take(_ENDS.size))
            lines.append(LineEntry(id, x1, y1, x2, y2, budget.pairs(reader)))
            _check((x1, y1, x2, y2), len(lines))
    except TooManyPairs:
        raise
    except BadMap:
        return None
    return lines


def pose_layer(usage: str, poses: list[PoseEntry]) -> Layer:
    """Return the layer of places or docks."""
    entries = (
        pack_text(p.name) + b"\0" + _POSE.pack(p.x, p.y, p.yaw) + pack_pairs(p.metadata) + bytes((p.flags,))
        for p in poses
    )
    return Layer(_named(usage, POSES, ("count", str(len(poses)))), b"".join(entries))


def read_poses(layer: Layer, usage: str, budget: Budget) -> list[PoseEntry] | None:
    """Return the poses in ``layer``; None for another layer or encoding. Raises TooManyPairs."""
    if not _is(layer, usage, "pose-map"):
        return None
    reader, poses = Reader(layer.payload), []
    try:
        while reader.at < len(layer.payload):
            name, unknown = reader.text(), reader.take(1)
            x, y, yaw = _POSE.unpack(reader.take(_POSE.size))
            poses.append(PoseEntry(name, x, y, yaw, budget.pairs(reader), reader.take(1)[0]))
            _check((x, y, yaw), len(poses))
            if unknown != b"\0":
                return None
    except TooManyPairs:
        raise
    except BadMap:
        return None
    return poses


def _check(numbers: tuple[float, ...], count: int) -> None:
    if count > ENTRIES_MAX or not all(abs(number) <= COORDINATE_MAX for number in numbers):
        raise BadMap("too many entries, or not where any map is")


def area_layer(areas: list[AreaEntry]) -> Layer:
    """Return the layer of areas, in our own encoding."""
    return Layer(_named(AREAS, JSON, ("count", str(len(areas)))), msgspec.json.encode(areas))


def read_areas(layer: Layer) -> list[AreaEntry] | None:
    """Return the areas in our own layer; None for any other."""
    return _read_json(layer, AREAS, list[AreaEntry])


def landmark_layer(marks: list[MarkEntry]) -> Layer:
    """Return the layer of landmarks, in our own encoding."""
    return Layer(_named(LANDMARKS, JSON, ("count", str(len(marks)))), msgspec.json.encode(marks))


def read_landmarks(layer: Layer) -> list[MarkEntry] | None:
    """Return the landmarks in our own layer; None for any other."""
    return _read_json(layer, LANDMARKS, list[MarkEntry])


def _read_json(layer: Layer, usage: str, kind: type[list[T]]) -> list[T] | None:
    if not _is(layer, usage, JSON):
        return None
    try:
        entries = msgspec.json.decode(layer.payload, type=kind)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
        return None
    return entries if len(entries) <= ENTRIES_MAX else None
