"""Chapter "labels": stored maps and their named points: get (6003), set, delete (6002)."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import msgspec

from roboglot.model.components.mapping.map_library import Label, MapLibrary, StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Point
from roboglot.operations import BadParameters, Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.context import Context
from roboglot.protocols.cyberdog.profile import Profile
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.protocols.cyberdog.vocabulary import grid_of, label_of, no_grid
from roboglot.validation import why_invalid
from roboglot.wire.cyberdog.channel import MESSAGE_MAX
from roboglot.wire.cyberdog.codes import Code

MAP_ID_MAX = 2**64 - 1
CELLS_MAX = MESSAGE_MAX // len("0,")  # of a map, so that it fits into an answer
LABELS_MAX = 256  # on one map
NAME_MAX = 128  # characters


class WireLabel(msgspec.Struct):
    """A label on the wire: name and place (map, m)."""

    labelName: str  # noqa: N815 - the wire's name
    physicX: float = math.nan  # noqa: N815 - absent where a label is to be deleted
    physicY: float = math.nan  # noqa: N815

    @property
    def valid(self) -> bool:
        """Return whether the label can be stored."""
        named = 0 < len(self.labelName) <= NAME_MAX
        return named and math.isfinite(self.physicX) and math.isfinite(self.physicY)


async def newest_map(
    context: Context, wanted: str = "", *, number: int = 0, outdoor: bool | None = None
) -> StoredMap | None:
    """Return the stored map: the one of that ``number``, else ``wanted``, else the one in use, else the newest.

    Real robots keep one map and ignore ``wanted`` while they have another. In the manual an unknown name means no map.
    ``outdoor`` restricts the kind of map. None if there is none.
    """
    if MapLibrary not in context.robot:
        return None
    library = context.robot[MapLibrary]
    numbered = await library.names(outdoor=outdoor, number=number) if number else ()
    names = list(await library.names(outdoor=outdoor))
    if context.profile is Profile.SPEC and wanted:
        candidates: tuple[str, ...] = (*numbered, wanted)
    else:
        candidates = (*numbered, context.stored_map, wanted, *reversed(names))
    found = next((name for name in candidates if name in names), None)
    return None if found is None else await library.get(found)


@TABLE.on(Code.GET_LABELS, right=Right.SEE, needs=(Mapping,))
async def get_labels(
    call: Call,
    *,
    mapName: str = "",  # noqa: N803 - the wire's name
    map_id: int = 0,
) -> dict[str, object]:
    """Return the stored map with its labels; without a stored map or a name, the one in memory.

    A map found is pushed (6001), too.
    """
    _check_number(map_id)
    context = call.context
    stored = await newest_map(context, mapName, number=map_id)
    grid = stored.grid if stored else context.robot[Mapping].grid
    in_memory = not context.map_deleted and (not mapName or context.profile is Profile.ROBOT)
    found = (stored is not None or in_memory) and 0 < grid.width * grid.height <= CELLS_MAX
    if found:
        context.reports.show_map(grid)
    return {
        "mapName": stored.name if stored else "",
        "success": 0 if found else 1,
        "is_outdoor": stored is not None and stored.outdoor,
        "locationLabelInfo": [label_of(label) for label in stored.labels] if stored else [],
        "map": grid_of(grid) if found else no_grid(),
    }


@TABLE.on(Code.SET_LABELS, right=Right.EDIT, needs=(MapLibrary,))
async def set_labels(
    call: Call,
    *,
    mapName: object = "",  # noqa: N803
    map_id: int = 0,
    locationLabelInfo: object = None,  # noqa: N803
    only_delete: object = False,
) -> dict[str, int]:
    """Replace the labels of a stored map; or delete the given ones; or, with none given, the map itself.

    A name, a list or ``only_delete`` of the wrong type or misspelt, taken as absent, would delete labels or a map: it
    is refused.

    With labels the map takes the number ``map_id`` on, if one is given; without a name it is the map of that number.
    """
    _check_number(map_id)
    call.check_spelling("mapName", "locationLabelInfo", "only_delete")
    context = call.context
    library = context.robot[MapLibrary]
    if not isinstance(only_delete, bool):
        raise BadParameters("only_delete is true or false")
    if not isinstance(mapName, str):
        raise BadParameters("mapName must be text")
    if locationLabelInfo is None and not only_delete:
        raise BadParameters("locationLabelInfo is missing")
    try:
        labels = msgspec.convert([] if locationLabelInfo is None else locationLabelInfo, list[WireLabel])
    except msgspec.ValidationError as error:
        raise BadParameters(why_invalid(error, field="locationLabelInfo", wanted=list[WireLabel])) from None
    names = [label.labelName for label in labels]
    settable = len(set(names)) == len(names) <= LABELS_MAX and all(label.valid for label in labels)
    if not settable and not only_delete:
        return call.refused({"success": 1}, f"at most {LABELS_MAX} labels, each with a name of its own and a place")
    kept = tuple(Label(x.labelName, Point(x.physicX, x.physicY)) for x in labels)
    try:
        name = mapName or await _numbered(library, map_id)
        if only_delete:
            await _delete(context, library, name, names)
        else:
            number = map_id if mapName else 0  # a map that was found by its number may have lost it meanwhile
            await library.modify(name, lambda stored: replace(stored, labels=kept, number=number or stored.number))
    except NotFound as error:
        return call.refused({"success": 1}, str(error))
    return {"success": 0}


async def _delete(context: Context, library: MapLibrary, name: str, labels: list[str]) -> None:
    """Delete the labels of these names; without names, the map. Raises NotFound."""
    if labels:
        await library.modify(name, partial(_without, labels=labels))
        return
    await library.remove(name)
    if context.stored_map == name or not await library.names():
        context.map_gone()


def _without(stored: StoredMap, labels: list[str]) -> StoredMap:
    if missing := set(labels) - {label.name for label in stored.labels}:
        raise NotFound(f"there is no label {missing}")
    return replace(stored, labels=tuple(x for x in stored.labels if x.name not in labels))


async def _numbered(library: MapLibrary, number: int) -> str:
    """Return the name of the map with that number. Raises NotFound."""
    names = await library.names(number=number) if number else ()
    if not names:
        raise NotFound(f"there is no map with the number {number}")
    return names[-1]


def _check_number(number: int) -> None:
    if not 0 <= number <= MAP_ID_MAX:
        raise BadParameters("map_id must be an unsigned 64-bit integer")
