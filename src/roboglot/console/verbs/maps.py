"""Verbs that change a robot's map and its annotations."""

from __future__ import annotations

import asyncio
import io
import uuid
import zipfile
from collections.abc import Callable
from dataclasses import replace
from typing import Annotated

import msgspec

from roboglot.console.drawings import NAMES
from roboglot.console.verbs.robots import SOURCE, VERBS, Meters, Name, Radians, Spot, Started, started, visible
from roboglot.media.ros_map import encode_ros_map
from roboglot.model.components.mapping.annotations import Annotations, Area, AreaKind, Line, LineKind, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary, StoredMap
from roboglot.model.components.mapping.map_memory import check_store
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.docking import Docking
from roboglot.model.errors import NotFound, Refused
from roboglot.model.geometry import ORIGIN, Point, Pose
from roboglot.model.map_loading import known_dock
from roboglot.model.map_loading import load_map as take_into_use
from roboglot.model.map_merging import aligned, merged
from roboglot.model.maps import OccupancyGrid, PointOfInterest
from roboglot.model.robot import Robot
from roboglot.operations import Right


class Placed(msgspec.Struct):
    """Pose of a map's origin in another map, m, rad."""

    x: float
    y: float
    yaw: float


HalfWidth = Annotated[float, msgspec.Meta(gt=0, le=1000)]


@VERBS.on("set_pose", right=Right.EDIT, needs=(Localization,))
async def set_pose(robot: Robot, *, x: Meters, y: Meters, yaw: Radians = 0.0) -> None:
    """Say that the robot stands there in its map."""
    robot[Localization].set_pose(Pose(x, y, yaw))


@VERBS.on("relocalize", right=Right.EDIT, needs=(Localization,))
async def relocalize(robot: Robot, *, may_move: bool = False) -> Started:
    """Find the robot anywhere in its map; if it may move, it drives around to tell places that look alike."""
    return started(robot[Localization].relocalize(may_move=may_move, source=SOURCE))


@VERBS.on("mapping", right=Right.EDIT, needs=(Mapping,))
async def mapping(robot: Robot, *, on: bool) -> None:
    """Go on or stop adding scans to the map."""
    robot[Mapping].enable(on)


@VERBS.on("clear_map", right=Right.EDIT, needs=(Mapping,))
async def clear_map(robot: Robot) -> None:
    """Forget the map; where the robot stands becomes the new origin."""
    robot.require(Mapping)
    await check_store(robot)
    robot[Mapping].clear()


@VERBS.on("add_place", right=Right.EDIT, needs=(Places,))
async def add_place(robot: Robot, *, name: Name, x: Meters, y: Meters, yaw: Radians = 0.0) -> str:
    """Put a named place on the map; the answer is its id."""
    id = str(uuid.uuid4())
    await robot[Places].put(PointOfInterest(id, Pose(x, y, yaw), {NAMES[0]: visible(name)}))
    return id


@VERBS.on("remove_place", right=Right.EDIT, needs=(Places,))
async def remove_place(robot: Robot, *, id: Name) -> None:
    """Take a place off the map."""
    await robot[Places].remove(id)


@VERBS.on("add_line", right=Right.EDIT, needs=(MapAnnotations,))
async def add_line(robot: Robot, *, kind: LineKind, start: Spot, end: Spot) -> None:
    """Draw a virtual wall or a track."""
    line = Line(0, kind, Point(*start), Point(*end))
    await robot[MapAnnotations].change(lambda now: now.with_new(line))


@VERBS.on("add_area", right=Right.EDIT, needs=(MapAnnotations,))
async def add_area(robot: Robot, *, kind: AreaKind, start: Spot, end: Spot, half_width: HalfWidth) -> None:
    """Draw an area: ``half_width`` m to both sides of the line from ``start`` to ``end``."""
    area = Area(0, kind, Point(*start), Point(*end), half_width)
    await robot[MapAnnotations].change(lambda now: now.with_new(area))


@VERBS.on("remove_drawing", right=Right.EDIT, needs=(MapAnnotations,))
async def remove_drawing(robot: Robot, *, id: int) -> None:
    """Take a line or an area off the map."""
    await robot[MapAnnotations].change(_without(id))


@VERBS.on("set_home", right=Right.EDIT, needs=(Docking, Localization))
async def set_home(robot: Robot) -> None:
    """Set the dock's pose to the robot's."""
    robot[Docking].set_home(robot[Localization].pose)


@VERBS.on("maps", right=Right.SEE, needs=(MapLibrary,))
async def maps(robot: Robot) -> list[str]:
    """List the maps that the robot keeps by name, oldest first."""
    return list(await robot[MapLibrary].names())


@VERBS.on("save_map", right=Right.EDIT, needs=(MapLibrary, Mapping))
async def save_map(robot: Robot, *, map: Name) -> None:
    """Keep the map in use under a name, with the dock; it replaces the one of that name."""
    grid = robot[Mapping].grid
    if not grid.width:
        raise Refused("the map is empty")
    await robot[MapLibrary].put(StoredMap(visible(map), grid, robot.clock.epoch(), dock=known_dock(robot)))


@VERBS.on("load_map", right=Right.EDIT, needs=(MapLibrary, Localization))
async def load_map(robot: Robot, *, map: Name, x: Meters = 0.0, y: Meters = 0.0, yaw: Radians = 0.0) -> Started:
    """Use a kept map from now on; the robot stands near the given pose in it, or looks for itself everywhere."""
    take_into_use(robot, await robot[MapLibrary].get(map), Pose(x, y, yaw))
    return started(robot[Localization].relocalize(source=SOURCE))


@VERBS.on("merge_map", right=Right.EDIT, needs=(MapLibrary, Mapping, Localization))
async def merge_map(robot: Robot, *, map: Name, x: Meters = 0.0, y: Meters = 0.0, yaw: Radians = 0.0) -> Placed:
    """Add a kept map to the map in use; its origin lies near the given pose, and exactly where walls fit.

    The answer is where it was laid.
    """
    stored, here = await robot[MapLibrary].get(map), robot[Mapping].grid
    if not here.width:
        raise Refused("the map is empty")
    place, grid = await asyncio.to_thread(_both, here, stored.grid, Pose(x, y, yaw))
    robot[Mapping].load(grid, robot[Localization].pose, origin=ORIGIN)
    return Placed(place.x, place.y, place.yaw)


def _both(here: OccupancyGrid, other: OccupancyGrid, guess: Pose) -> tuple[Pose, OccupancyGrid]:
    here = OccupancyGrid(here.log_odds.copy(), here.resolution, here.origin)
    place = aligned(here, other, guess)
    return place, merged(here, other, place)


@VERBS.on("remove_map", right=Right.EDIT, needs=(MapLibrary,))
async def remove_map(robot: Robot, *, map: Name) -> None:
    """Forget a kept map; the map in use stays."""
    await robot[MapLibrary].remove(map)


async def map_archive(robot: Robot) -> bytes:
    """Return the map in use as a zip of map.yaml and map.pgm, as map_server of ROS keeps maps."""
    grid = robot[Mapping].grid
    if not grid.width:
        raise Refused("the map is empty")
    return await asyncio.to_thread(_packed, *encode_ros_map(grid, "map"))


def _packed(about: bytes, image: bytes) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("map.yaml", about)
        archive.writestr("map.pgm", image)
    return packed.getvalue()


def _without(id: int) -> Callable[[Annotations], Annotations]:
    def edit(now: Annotations) -> Annotations:
        lines = tuple(line for line in now.lines if line.id != id)
        areas = tuple(area for area in now.areas if area.id != id)
        if (len(lines), len(areas)) == (len(now.lines), len(now.areas)):
            raise NotFound(f"no line or area {id} is drawn")
        return replace(now, lines=lines, areas=areas)

    return edit
