"""Chapter "slam": the map in memory, as a grid and as a composite map."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated

import msgspec

from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import MapMemory
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import ORIGIN, Point, Pose
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.motion.home_docks import known_docks
from roboglot.protocols.slamware.chapters.slam.composite import explore_map
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters.platform import GeneralEvent
from roboglot.wire.slamware.chapters.slam.explore_map import encode_explore_map
from roboglot.wire.slamware.chapters.slam.localization import NewOrigin
from roboglot.wire.slamware.geometry import COORDINATE_MAX

API = "/api/core/slam/v1"
REACH_MAX = 0.99 * COORDINATE_MAX  # m from an origin, with room for the robot to drive
Bound = Annotated[float, msgspec.Meta(ge=-COORDINATE_MAX, le=COORDINATE_MAX)]


@TABLE.on(f"GET {API}/maps/explore", right=Right.SEE, needs=(Mapping,))
def get_explore_map(
    context: Context,
    min_x: Bound | None = None,
    min_y: Bound | None = None,
    max_x: Bound | None = None,
    max_y: Bound | None = None,
) -> bytes:
    """Return the map as binary (see the wire's explore_map), or the part within a window (m)."""
    grid = context.robot[Mapping].grid
    if any(bound is not None for bound in (min_x, min_y, max_x, max_y)):
        grid = grid.window(
            -COORDINATE_MAX if min_x is None else min_x,
            -COORDINATE_MAX if min_y is None else min_y,
            COORDINATE_MAX if max_x is None else max_x,
            COORDINATE_MAX if max_y is None else max_y,
        )
    return encode_explore_map(explore_map(grid))


@TABLE.on(f"GET {API}/maps/stcm", right=Right.SEE, needs=(Docking, MapAnnotations, Mapping, Places, Settings))
def get_composite_map(context: Context) -> bytes:
    """Return the map with all its drawings as a composite map; 403 while one is being loaded."""
    return context.maps.export()


@TABLE.on(f"PUT {API}/maps/stcm", right=Right.EDIT, needs=(Localization, MapAnnotations, MapMemory, Mapping, Settings))
async def set_composite_map(context: Context, body: bytes) -> None:
    """Replace the map and its drawings, in memory only; the robot's pose becomes the origin."""
    await context.maps.use(body, ORIGIN, stop=context.actions.abort)  # a refusal stops nothing
    context.events.note(GeneralEvent.SET_MAP_DONE)


@TABLE.on(f"DELETE {API}/maps", right=Right.EDIT, needs=(FileStore, Localization, MapMemory, Mapping, Settings))
async def clear_map(context: Context) -> None:
    """Clear the map and start a new one here. Drawings and docks keep their places in new coordinates.

    In memory only: a restart loads the map on disk.
    """
    origin = context.robot[Localization].pose
    if MapAnnotations in context.robot and Places in context.robot:
        _check_reach(Pose(p.x, p.y).relative_to(origin).point for p in _drawn(context.robot))
    await context.maps.clear()


@TABLE.on(f"PUT {API}/maps/origin", right=Right.EDIT, needs=(MapAnnotations, MapMemory, Mapping, Places, Settings))
async def move_origin_point(context: Context, body: NewOrigin) -> None:
    """Move the map's origin to this place, to the nearest 5 cm; drawings keep their places."""
    robot = context.robot
    wanted = Point(body.new_origin.x, body.new_origin.y)
    _check_reach(Point(p.x - wanted.x, p.y - wanted.y) for p in (robot[Mapping].grid.origin, *_drawn(robot)))
    context.actions.abort()
    await context.maps.move_origin(wanted)


def _check_reach(points: Iterable[Point]) -> None:
    """Raise InvalidGoal for points so far from the origin that the map could not be saved and loaded again."""
    for point in points:
        if max(abs(point.x), abs(point.y)) > REACH_MAX:
            raise InvalidGoal(f"a drawing would be at ({point.x:g}, {point.y:g}), too far from the origin")


def _drawn(robot: Robot) -> Iterator[Point]:
    """Return all points of drawings on the map."""
    notes = robot[MapAnnotations].current
    for line in notes.lines:
        yield from (line.start, line.end, *(line.control or ()))
    for area in notes.areas:
        yield from (area.start, area.end)
    docks = known_docks(robot) if Docking in robot else notes.docks
    for mark in (*docks, *notes.landmarks, *robot[Places].all()):
        yield mark.pose.point
