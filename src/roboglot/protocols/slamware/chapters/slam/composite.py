"""Conversion between composite maps and the model: grid and drawings of one floor. Knows no robot."""

from __future__ import annotations

import uuid
from collections.abc import Iterable, Sequence
from dataclasses import field, replace
from typing import TypeVar

import msgspec
import numpy as np

from roboglot.model.components.mapping.annotations import Annotations, Area, Line, LineKind
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid, PointOfInterest
from roboglot.protocols.slamware.chapters.artifact.drawing import AREA_USAGES, area_of, line_of, metadata_of
from roboglot.validation import why_invalid
from roboglot.values import dataclass
from roboglot.wire.slamware import geometry
from roboglot.wire.slamware.chapters import artifact
from roboglot.wire.slamware.chapters.slam import stcm_layers
from roboglot.wire.slamware.chapters.slam.explore_map import BadMap, ExploreMap
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, Layer, Pairs
from roboglot.wire.slamware.chapters.slam.stcm_layers import AreaEntry, LineEntry, MarkEntry

T = TypeVar("T")
ORDER_MAX = 10_000
DRAWN_BYTES_MAX = 16 << 20  # of a file's lines, poses and areas, which are read one by one
DRAWN_MAX = 100_000  # such entries of a file, on all floors
DRAWN_USAGES = {
    stcm_layers.WALLS,
    stcm_layers.TRACKS,
    stcm_layers.PLACES,
    stcm_layers.DOCKS,
    stcm_layers.AREAS,
    stcm_layers.LANDMARKS,
}
LINE_LAYERS = {stcm_layers.WALLS: LineKind.WALL, stcm_layers.TRACKS: LineKind.TRACK}


@dataclass(frozen=True, slots=True)
class FloorName:
    """Building and floor that a map shows. Maps without a name are of floor "1F"."""

    building: str = ""
    floor: str = "1F"
    order: int = 0
    default: bool = True

    @property
    def pairs(self) -> Pairs:
        """Return the name as layers carry it."""
        default = "true" if self.default else "false"
        return (("building", self.building), ("floor", self.floor), ("order", str(self.order)), ("default", default))

    @property
    def map_id(self) -> str:
        """A UUID, the same for the same floor."""
        return str(uuid.uuid5(uuid.NAMESPACE_OID, f"{self.building}/{self.floor}"))


@dataclass(frozen=True, slots=True)
class FloorMap:
    """One floor: its grid, its drawings, and the layers of unknown kinds."""

    name: FloorName = field(default_factory=FloorName)
    grid: OccupancyGrid | None = None
    annotations: Annotations = field(default_factory=Annotations)
    places: tuple[PointOfInterest, ...] = ()
    layers: tuple[Layer, ...] = ()


def explore_map(grid: OccupancyGrid) -> ExploreMap:
    """Return ``grid`` with the vendor's sign: free above 0, occupied below."""
    cells = -np.maximum(grid.log_odds, -127)
    return ExploreMap(grid.origin.x, grid.origin.y, grid.resolution, cells.astype(np.int8))


def grid_of(explored: ExploreMap) -> OccupancyGrid:
    """Return the grid of an explore map."""
    log_odds = (-np.maximum(explored.cells, -127)).astype(np.int8)
    return OccupancyGrid(log_odds, explored.resolution, Point(explored.x, explored.y))


def composite_of(floor: FloorMap) -> CompositeMap:
    """Return the layers of a floor, without empty ones. Raises BadMap for content that could not be read back."""
    notes, label = floor.annotations, floor.name.pairs
    stcm_layers.Budget().take(
        sum(len(e.metadata) for e in notes.lines) + sum(len(m.metadata) for m in (*floor.places, *notes.docks))
    )
    layers = [stcm_layers.grid_layer(explore_map(floor.grid), label)] if floor.grid is not None else []
    for usage, kind in LINE_LAYERS.items():
        lines = [
            LineEntry(str(e.id), e.start.x, e.start.y, e.end.x, e.end.y, tuple(metadata_of(e).items()))
            for e in notes.lines_of(kind)
        ]
        layers += [_labelled(stcm_layers.line_layer(usage, lines), label)] if lines else []
    for usage, marks in ((stcm_layers.PLACES, floor.places), (stcm_layers.DOCKS, notes.docks)):
        poses = [stcm_layers.PoseEntry(m.id, m.pose.x, m.pose.y, m.pose.yaw, tuple(m.metadata.items())) for m in marks]
        layers += [_labelled(stcm_layers.pose_layer(usage, poses), label)] if poses else []
    areas = [
        AreaEntry(a.id, AREA_USAGES[a.kind], a.start.x, a.start.y, a.end.x, a.end.y, a.half_width, dict(a.metadata))
        for a in notes.areas
    ]
    layers += [_labelled(stcm_layers.area_layer(areas), label)] if areas else []
    landmarks = [MarkEntry(m.id, m.pose.x, m.pose.y, m.pose.yaw, dict(m.metadata)) for m in notes.landmarks]
    layers += [_labelled(stcm_layers.landmark_layer(landmarks), label)] if landmarks else []
    composite = CompositeMap((*layers, *floor.layers))
    _check_size(composite)
    return composite


def _labelled(layer: Layer, label: Pairs) -> Layer:
    return replace(layer, pairs=layer.pairs + label)


def floors_of(composite: CompositeMap) -> list[FloorMap]:
    """Return the floors in a file, lowest first. Raises BadMap or InvalidGoal for malformed layers.

    Layers that name no floor belong to the default one.
    """
    names: dict[tuple[str, str], FloorName] = {}
    budget = stcm_layers.Budget()
    _check_size(composite)
    for layer in composite.layers:
        values = layer.metadata
        if values.get("floor"):
            key = (clean(values.get("building", "")), clean(values["floor"]))
            names.setdefault(key, _floor_name(*key, values.get("order", ""), values.get("default", "")))
    if not names:
        return _bounded([_read(FloorName(), list(composite.layers), budget)])
    default = next((name for name in names.values() if name.default), next(iter(names.values())))
    layers: dict[FloorName, list[Layer]] = {replace(n, default=n is default): [] for n in names.values()}
    by_key = {(name.building, name.floor): name for name in layers}
    for layer in composite.layers:
        values = layer.metadata
        key = (clean(values.get("building", "")), clean(values.get("floor", "")))
        layers[by_key.get(key, by_key[default.building, default.floor])].append(layer)
    return _bounded(_read(name, layers[name], budget) for name in sorted(layers, key=lambda name: name.order))


def _check_size(composite: CompositeMap) -> None:
    """Raise BadMap for a file too large to be read in a few seconds."""
    drawn = sum(len(layer.payload) for layer in composite.layers if layer.metadata.get("usage") in DRAWN_USAGES)
    if drawn > DRAWN_BYTES_MAX:
        raise BadMap(f"{drawn} bytes of places, lines and areas: at most {DRAWN_BYTES_MAX}")


def _bounded(floors: Iterable[FloorMap]) -> list[FloorMap]:
    """Return the floors. Raises BadMap for too many drawings."""
    read, count = [], 0
    for floor in floors:
        notes = floor.annotations
        count += sum(map(len, (notes.lines, notes.areas, notes.docks, notes.landmarks, floor.places)))
        _check_count(count)
        read.append(floor)
    return read


def _check_count(count: int) -> None:
    if count > DRAWN_MAX:
        raise BadMap(f"more than {DRAWN_MAX} places, lines and areas")


def _floor_name(building: str, floor: str, order: str, default: str) -> FloorName:
    number = int(order) if order.lstrip("-").isascii() and order.lstrip("-").isdigit() and len(order) < 6 else 0
    return FloorName(building, floor, max(-ORDER_MAX, min(number, ORDER_MAX)), default.lower() in ("true", "1"))


def _read(name: FloorName, layers: Sequence[Layer], budget: stcm_layers.Budget) -> FloorMap:
    """Return the floor of these layers."""
    grid: OccupancyGrid | None = None
    lines: list[Line] = []
    areas: list[Area] = []
    marks: dict[str, list[PointOfInterest]] = {stcm_layers.PLACES: [], stcm_layers.DOCKS: []}
    landmarks: list[PointOfInterest] = []
    unknown: list[Layer] = []
    for layer in layers:
        usage = layer.metadata.get("usage", "")
        if grid is None and (explored := stcm_layers.read_grid(layer)) is not None:
            grid = grid_of(explored)
        elif usage in LINE_LAYERS and (found := stcm_layers.read_lines(layer, usage, budget)) is not None:
            lines += [_line(usage, entry) for entry in found]
        elif usage in marks and (poses := stcm_layers.read_poses(layer, usage, budget)) is not None:
            marks[usage] += [_mark(p.name, Pose(p.x, p.y, p.yaw), dict(p.metadata)) for p in poses]
        elif (entries := stcm_layers.read_areas(layer)) is not None:
            areas += [_area(entry) for entry in entries]
        elif (known := stcm_layers.read_landmarks(layer)) is not None:
            landmarks += [_mark(m.id, Pose(m.x, m.y, m.yaw), m.metadata) for m in known]
        else:
            unknown.append(layer)
        drawn = len(lines) + len(areas) + len(landmarks) + sum(map(len, marks.values()))
        _check_count(drawn)  # at once: a file may have 1000 layers
    notes = Annotations(docks=tuple(marks[stcm_layers.DOCKS]), landmarks=tuple(landmarks)).with_new(*lines, *areas)
    return FloorMap(name, grid, notes, tuple(marks[stcm_layers.PLACES]), tuple(unknown))


def _line(usage: str, entry: LineEntry) -> Line:
    ends = geometry.Point(entry.x1, entry.y1), geometry.Point(entry.x2, entry.y2)
    return line_of(LINE_LAYERS[usage], artifact.Line(*ends, metadata={**_texts(dict(entry.metadata))}))


def _area(entry: AreaEntry) -> Area:
    rectangle = artifact.Strip(
        geometry.Point(entry.x1, entry.y1), geometry.Point(entry.x2, entry.y2), abs(entry.half_width)
    )
    try:
        usage = artifact.AreaUsage(entry.usage)
    except ValueError:
        raise BadMap(f"there are no areas {entry.usage[:40]}") from None
    return area_of(usage, rectangle, _texts(entry.metadata))


def _mark(id: str, pose: Pose, metadata: dict[str, str]) -> PointOfInterest:
    try:
        return PointOfInterest(msgspec.convert(clean(id), artifact.Identifier), pose, _texts(metadata))
    except msgspec.ValidationError as error:
        raise InvalidGoal(f"the name {clean(id)[:40]!r} of a place: {why_invalid(error)}") from None


def _texts(metadata: dict[str, str]) -> dict[str, str]:
    """Return a file's metadata. Raises BadMap beyond the API's limits."""
    if len(metadata) > artifact.METADATA_MAX or any(len(v) > artifact.METADATA_TEXT_MAX for v in metadata.values()):
        raise BadMap("an entry has too much metadata")
    return {clean(key): clean(value) for key, value in metadata.items()}


def clean(text: str) -> str:
    """Return a file's text as Unicode, with invalid bytes replaced."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
