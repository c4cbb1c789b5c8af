"""Several maps as the floors of one composite map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from uuid import NAMESPACE_OID, uuid5

from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, FloorName, composite_of, floors_of
from roboglot.simulation.world.world_files import read_ros_grid
from roboglot.text_files import bytes_of
from roboglot.wire.slamware.chapters.slam.explore_map import BadMap
from roboglot.wire.slamware.chapters.slam.stcm import MAP_BYTES_MAX, CompositeMap, Layer, decode_stcm, encode_stcm

FLOORS_MAX = 100
LABELS = ("building", "floor", "order", "default")


def merged(floors: Sequence[str], building: str, fetch: Callable[[str], bytes]) -> bytes:
    """Return a composite map with a floor for each "NAME=SOURCE", lowest first; the robot starts on the first.

    A source is a composite map's file (of one floor, or with one of that name), a ROS map (.yaml), or a robot's http://
    address, from which ``fetch`` gets the map.
    Raises BadMap and ValueError in plain words, OSError.
    """
    if not 0 < len(floors) <= FLOORS_MAX:
        raise ValueError(f"1 to {FLOORS_MAX} floors are needed: --floor 1F=ground.stcm --floor 2F=first.stcm")
    layers: list[Layer] = []
    names: set[str] = set()
    ids: set[str] = set()
    for order, text in enumerate(floors):
        name, separator, source = text.partition("=")
        if not separator or not name.strip() or not source:
            raise ValueError(f"a floor is NAME=SOURCE, not {text!r}")
        if name in names:
            raise ValueError(f"there are two floors {name!r}")
        names.add(name)
        floor = _with_own_ids(_floor_of(name, source, fetch), name, ids)
        label = FloorName(building, name, order, default=order == 0)
        kept = tuple(_labelled(layer, label) for layer in floor.layers)
        layers += composite_of(replace(floor, name=label, layers=kept)).layers
    data = encode_stcm(CompositeMap(tuple(layers)))
    if len(floors_of(decode_stcm(data))) != len(floors):
        raise BadMap("two floors have the same name")
    return data


def _floor_of(name: str, source: str, fetch: Callable[[str], bytes]) -> FloorMap:
    """Return the only floor of a source, or the one of that name."""
    if source.endswith((".yaml", ".yml")):
        return FloorMap(grid=read_ros_grid(Path(source)))
    data = fetch(source) if "://" in source else bytes_of(Path(source), MAP_BYTES_MAX)
    floors = [floor for floor in floors_of(decode_stcm(data)) if floor.grid is not None and floor.grid.width]
    if not floors:
        raise BadMap(f"the map of {source} is empty")
    named = [floor for floor in floors if floor.name.floor == name]
    if len(floors) > 1 and len(named) != 1:
        there = ", ".join(floor.name.floor for floor in floors)
        raise BadMap(f"{source} has the floors {there}, and {name!r} is not one of them")
    return named[0] if len(floors) > 1 else floors[0]


def _with_own_ids(floor: FloorMap, name: str, ids: set[str]) -> FloorMap:
    """Return the floor with new ids for docks whose ids are in ``ids``: a robot has one for those that it finds."""
    docks = floor.annotations.docks
    own = tuple(replace(d, id=str(uuid5(NAMESPACE_OID, d.id + name))) if d.id in ids else d for d in docks)
    ids.update(dock.id for dock in own)
    return replace(floor, annotations=replace(floor.annotations, docks=own))


def _labelled(layer: Layer, label: FloorName) -> Layer:
    """Return a layer of unknown kind on its new floor."""
    others = tuple(pair for pair in layer.pairs if pair[0] not in LABELS)
    return replace(layer, pairs=others + label.pairs)
