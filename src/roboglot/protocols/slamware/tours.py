"""Chapter "multi-floor": in which order to visit places so that the way is shortest."""

from __future__ import annotations

from typing import Annotated

import msgspec

from roboglot.model.components.localization import Localization
from roboglot.model.components.navigation import Navigation
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.geometry import Point
from roboglot.protocols.slamware.home import NAME
from roboglot.protocols.slamware.operations import OPERATIONS, Desk

STOPS_MAX = 10  # the time to find the best order doubles with every one
StopName = Annotated[str, msgspec.Meta(min_length=1, max_length=4096)]


@OPERATIONS.on("POST /api/multi-floor/map/v1/pois/:dispatch")
async def dispatch_by_pois(desk: Desk, body: list[StopName]) -> list[str]:
    """The names in the order of the shortest round trip from here, by the ways that the robot would drive.

    400 for more than ten or what cannot be reached, 404 for places that this floor of the loaded map does not have.
    """
    if len(body) > STOPS_MAX:
        raise InvalidGoal(f"at most {STOPS_MAX} places, not {len(body)}")
    places = {
        name: place.pose.point
        for floor in desk.maps.floors
        if floor.name == desk.maps.current
        for place in floor.places
        for name in (place.metadata.get(NAME, place.id), place.id)
    }
    if missing := [name for name in body if name not in places]:
        raise NotFound(f"no places {missing}")
    stops = [desk.robot[Localization].pose.point, *(places[name] for name in body)]
    return [body[number - 1] for number in round_trip(await _lengths(desk.robot[Navigation], stops))]


async def _lengths(navigation: Navigation, stops: list[Point]) -> list[list[float]]:
    """The length (m) of the way between each two; as long back as there."""
    lengths = [[0.0] * len(stops) for _ in stops]
    for i, start in enumerate(stops):
        for j in range(i + 1, len(stops)):
            way = 0.0 if start.distance_to(stops[j]) == 0.0 else (await navigation.plan(start, stops[j])).length
            lengths[i][j] = lengths[j][i] = way
    return lengths


def round_trip(lengths: list[list[float]]) -> list[int]:
    """The stops 1, 2, … in the order of the shortest way from 0 through all of them and back to 0 (Held and Karp)."""
    stops = range(1, len(lengths))
    best: dict[tuple[frozenset[int], int], tuple[float, tuple[int, ...]]] = {
        (frozenset((stop,)), stop): (lengths[0][stop], (stop,)) for stop in stops
    }
    for _ in range(len(stops) - 1):
        longer: dict[tuple[frozenset[int], int], tuple[float, tuple[int, ...]]] = {}
        for (seen, last), (way, order) in best.items():
            for stop in stops:
                if stop not in seen:
                    key, found = (seen | {stop}, stop), (way + lengths[last][stop], (*order, stop))
                    if key not in longer or found < longer[key]:
                        longer[key] = found
        best = longer
    return list(min((way + lengths[last][0], order) for (_, last), (way, order) in best.items())[1]) if best else []
