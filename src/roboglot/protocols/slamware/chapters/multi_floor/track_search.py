"""Chapter "multi-floor": ways along the virtual tracks."""

from __future__ import annotations

from roboglot.model.components.mapping.annotations import LineKind, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.track_graph import way_along
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Point
from roboglot.operations import Right
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters.motion import PathPoints
from roboglot.wire.slamware.chapters.multi_floor import TrackQuery


@TABLE.on("POST /api/multi-floor/map/v1/search_path_points", right=Right.SEE, needs=(Localization, MapAnnotations))
def search_path_points_in_graph(context: Context, body: TrackQuery) -> PathPoints:
    """Return the shortest way along the tracks, each from its start to its end only if ``with_direction``.

    Empty if there is none; 400 for a floor that is not loaded, or for another one without a start.
    """
    here = context.maps.current
    wanted = (body.building or here.building, body.floor or here.floor)
    if wanted == (here.building, here.floor):
        drawn = context.robot[MapAnnotations].current
    else:
        loaded = {(floor.name.building, floor.name.floor): floor.annotations for floor in context.maps.floors}
        if wanted not in loaded:
            raise InvalidGoal("the loaded map has no such floor")
        if body.start_point is None:
            raise InvalidGoal("the robot is on another floor: give a start_point")
        drawn = loaded[wanted]
    given = body.start_point
    start = Point(given.x, given.y) if given else context.robot[Localization].pose.point
    end = Point(body.end_point.x, body.end_point.y)
    way = way_along(drawn.lines_of(LineKind.TRACK), start, end, directed=body.with_direction)
    return PathPoints([(point.x, point.y) for point in way])
