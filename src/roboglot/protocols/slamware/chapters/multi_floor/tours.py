"""Chapter "multi-floor": the shortest order of places to visit."""

from __future__ import annotations

from typing import Annotated

import msgspec

from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.errors import NotFound
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.motion.home_docks import NAME
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE

STOPS_MAX = 500
StopName = Annotated[str, msgspec.Meta(min_length=1, max_length=4096)]


@TABLE.on("POST /api/multi-floor/map/v1/pois/:dispatch", right=Right.SEE, needs=(Navigation,))
async def dispatch_by_pois(
    context: Context, body: Annotated[list[StopName], msgspec.Meta(max_length=STOPS_MAX)]
) -> list[str]:
    """Return names in the order of the shortest round trip from here, by planned paths.

    Exact up to 12, beyond them nearly the shortest. 400 for more than 500 or what cannot be reached, 404 for places
    that this floor of the loaded map does not have.
    """
    places = {
        name: place.pose.point
        for floor in context.maps.floors
        if floor.name == context.maps.current
        for place in floor.places
        for name in (place.metadata.get(NAME, place.id), place.id)
    }
    if missing := [name for name in body if name not in places]:
        raise NotFound(f"no places {missing[:20]}")
    order = await context.robot[Navigation].visiting_order([places[name] for name in body], round_trip=True)
    return [body[number] for number in order]
