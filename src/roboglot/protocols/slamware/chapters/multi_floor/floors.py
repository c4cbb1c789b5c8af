"""Chapter "multi-floor": the map on disk, its floors, and their places and docks."""

from __future__ import annotations

from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import MapMemory
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal, NotFound, RobotError
from roboglot.model.maps import PointOfInterest
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.motion.home_docks import BOUND, NAME, before, home_dock, settle_home
from roboglot.protocols.slamware.chapters.multi_floor.elevators import elevator_around
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, FloorName
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import NO_CONTENT, TABLE, NoContent
from roboglot.protocols.slamware.vocabulary import pose2d, pose_of
from roboglot.wire.slamware.chapters.multi_floor import (
    BoundDock,
    CurrentFloorInfo,
    DockChoice,
    DockInfo,
    FloorChoice,
    FloorInfo,
    FloorText,
    MultiFloorStatus,
    NearbyPoi,
    PoiChoice,
    PoiInfo,
    Reload,
    Unbinding,
)
from roboglot.wire.slamware.geometry import Point

MAP, LOCALIZATION = "/api/multi-floor/map/v1", "/api/multi-floor/localization/v1"


@TABLE.on("GET /api/multi-floor/status", right=Right.SEE, needs=(Mapping, Settings))
def get_status(context: Context) -> MultiFloorStatus:
    """Return the status of the map on disk."""
    return MultiFloorStatus(
        context.robot[Mapping].enabled, context.maps.status, is_managed_by_cloud=context.cloud.managed
    )


@TABLE.on(f"POST {MAP}/stcm", right=Right.EDIT, needs=(FileStore,))
async def upload_map(context: Context, body: bytes) -> None:
    """Store a composite map on disk, for the next reload; 400 for a malformed one."""
    await context.maps.upload(body)


@TABLE.on(f"DELETE {MAP}/stcm", right=Right.EDIT, needs=(FileStore,))
async def delete_map(context: Context) -> NoContent:
    """Delete the map on disk; the one in memory stays."""
    await context.maps.delete()
    return NO_CONTENT


@TABLE.on(
    f"POST {MAP}/stcm/:save",
    right=Right.EDIT,
    needs=(Docking, FileStore, MapAnnotations, MapMemory, Mapping, Places, Settings),
)
async def save_stcm(context: Context) -> None:
    """Save the map in memory to disk; 403 if the one on disk has several floors."""
    await context.maps.save()


@TABLE.on(
    f"POST {MAP}/stcm/:reload",
    right=Right.EDIT,
    needs=(FileStore, Localization, MapAnnotations, MapMemory, Mapping, Settings),
)
async def reload_stcm(context: Context, body: Reload | None = None) -> None:
    """Load the map from disk; without a pose the robot is on its dock, or in front of it. 404 if none is saved."""
    pose = pose_of(body.pose) if body and body.pose else None
    await context.maps.reload(pose, stop=context.actions.abort)  # a refusal stops nothing


@TABLE.on(
    f"POST {MAP}/stcm/:sync",
    right=Right.EDIT,
    needs=(Docking, FileStore, MapAnnotations, MapMemory, Mapping, Places, Settings),
)
async def sync_stcm(context: Context) -> None:
    """Save and reload, so that multi-floor operations know new places; the robot keeps its pose."""
    await context.maps.sync()


@TABLE.on(f"POST {MAP}/scene/unbind", right=Right.ADMIN, needs=(FileStore, Settings))
async def unbind_scene(context: Context, body: Unbinding | None = None) -> None:
    """Unbind the robot from its cloud, if any; the map on disk is deleted unless it is to be kept."""
    await context.cloud.leave()
    if not (body and body.keep_local_map):
        await context.maps.delete()


@TABLE.on(f"GET {MAP}/floors", right=Right.SEE, needs=(Settings,))
def get_floors(context: Context) -> list[FloorInfo]:
    """Return the floors of the loaded map; none before the first load."""
    start, names = context.maps.start_floor, [floor.name for floor in context.maps.floors]
    return [FloorInfo(n.building, n.floor, n.order, start is not None and n == start.name) for n in names]


@TABLE.on(f"GET {MAP}/floors/:current", right=Right.SEE, needs=(Localization, MapAnnotations))
def get_current_floor(context: Context) -> CurrentFloorInfo:
    """Return the floor whose map is in memory, and the elevator that the robot is in."""
    name = context.maps.current
    return CurrentFloorInfo(name.building, name.floor, elevator_around(context.robot), name.map_id)


@TABLE.on(f"PUT {MAP}/floors/:current", right=Right.DRIVE)
async def set_current_floor(context: Context, body: FloorChoice) -> None:
    """Switch to the map of the floor that the robot was carried to; 404 if it is not loaded."""
    pose = pose_of(body.pose) if body.pose else None
    await context.maps.enter(body.building, body.floor, pose, stop=context.actions.abort)


def _selected(context: Context, floor: str, building: str) -> list[FloorMap]:
    """Return the loaded floors that a query selects. Raises InvalidGoal if there is none."""
    loaded = [
        f
        for f in context.maps.floors
        if (not building or f.name.building == building) and (not floor or f.name.floor == floor)
    ]
    if not loaded and (floor or building):
        raise InvalidGoal("the loaded map has no such floor")
    return loaded


def _poi(name: FloorName, place: PointOfInterest) -> PoiInfo:
    shown = place.metadata.get(NAME, place.id)
    kind = place.metadata.get("type", "")
    return PoiInfo(place.id, shown, name.floor, name.building, pose2d(place.pose), kind)


def _dock(name: FloorName, dock: PointOfInterest) -> DockInfo:
    return DockInfo(dock.id, dock.metadata.get(NAME, dock.id), name.floor, name.building, pose2d(dock.pose))


@TABLE.on(f"GET {MAP}/pois", right=Right.SEE)
def get_all_pois(context: Context, floor: FloorText = "", building: FloorText = "") -> list[PoiInfo]:
    """Return the places of the loaded map, of one floor or of all; new ones appear after a sync."""
    return [_poi(f.name, place) for f in _selected(context, floor, building) for place in f.places]


@TABLE.on(f"GET {MAP}/homedocks", right=Right.SEE)
def get_multi_floor_home_docks(context: Context, floor: FloorText = "", building: FloorText = "") -> list[DockInfo]:
    """Return the docks of the loaded map, of one floor or of all."""
    return [_dock(f.name, dock) for f in _selected(context, floor, building) for dock in f.annotations.docks]


@TABLE.on(f"POST {MAP}/pois/:search_nearby", right=Right.SEE, needs=(Localization, MapAnnotations))
def search_nearby_poi(context: Context) -> NearbyPoi:
    """Return the nearest place on this floor; ON_DOCK, IN_ELEVATOR, or UNKNOWN if there is none."""
    if DockContact in context.robot and context.robot[DockContact].docked:
        return NearbyPoi("ON_DOCK", relative_pose=Point(0.0, 0.0))
    if elevator_around(context.robot):
        return NearbyPoi("IN_ELEVATOR", relative_pose=Point(0.0, 0.0))
    here = context.robot[Localization].pose
    places = [place for floor in _here(context) for place in floor.places]
    if not places:
        return NearbyPoi("UNKNOWN")
    nearest = min(places, key=lambda place: place.pose.distance_to(here))
    seen = nearest.pose.relative_to(here)
    return NearbyPoi(nearest.metadata.get(NAME, nearest.id), nearest.id, Point(seen.x, seen.y))


@TABLE.on(f"POST {MAP}/homedocks/:search_nearby", right=Right.SEE, needs=(Localization,))
def search_nearby_home_dock(context: Context) -> DockInfo:
    """Return the nearest dock on this floor, in a straight line; 404 if there is none."""
    here = context.robot[Localization].pose
    docks = [(floor, dock) for floor in _here(context) for dock in floor.annotations.docks]
    if not docks:
        raise NotFound("the loaded map has no dock on this floor")
    floor, nearest = min(docks, key=lambda found: found[1].pose.distance_to(here))
    return _dock(floor.name, nearest)


def _here(context: Context) -> list[FloorMap]:
    """Return the loaded map of the robot's floor, if any."""
    return [floor for floor in context.maps.floors if floor.name == context.maps.current]


@TABLE.on(f"GET {MAP}/homedocks/:current", right=Right.SEE, needs=(Settings,))
def get_current_home_dock(context: Context) -> BoundDock:
    """Return the dock that the robot is bound to."""
    bound = context.robot[Settings].get(BOUND)
    found = _find_dock(context, bound) if bound else None
    if found is None:
        return BoundDock(result=False, msg="no dock is bound")
    return BoundDock(result=True, msg="", data=_dock(found[0].name, found[1]))


@TABLE.on(f"PUT {MAP}/homedocks/:current", right=Right.EDIT, needs=(Docking, MapAnnotations, Settings))
async def set_current_home_dock(context: Context, body: DockChoice) -> None:
    """Bind the robot to a dock. If that is on neither its floor nor the start floor, it is taken to be on the dock."""
    found = _find_dock(context, body.dock_id)
    if found is None:
        raise NotFound(f"the loaded map has no dock {body.dock_id}")
    floor, dock = found
    start = context.maps.start_floor
    known = {context.maps.current, start and start.name}
    settings = context.robot[Settings]
    bound = settings.get(BOUND)
    await settings.put(BOUND, dock.id)
    if floor.name not in known:
        try:
            await context.maps.enter(floor.name.building, floor.name.floor, dock.pose, stop=context.actions.abort)
        except RobotError:
            await settings.keep(BOUND, bound)
            raise
    settle_home(context.robot)


@TABLE.on(f"PUT {LOCALIZATION}/pose", right=Right.DRIVE, needs=(Localization,))
def set_pose_by_poi(context: Context, body: PoiChoice) -> bool:
    """Set the robot's pose to a place of the floor, by name or id; 404 if there is none."""
    for place in (place for floor in _here(context) for place in floor.places):
        if body.poi_name in (place.metadata.get(NAME), place.id):
            context.robot[Localization].set_pose(place.pose)
            return True
    raise NotFound(f"no place {body.poi_name} on this floor of the loaded map")


@TABLE.on(f"PUT {LOCALIZATION}/homedock", right=Right.DRIVE, needs=(Docking, Localization, MapAnnotations, Settings))
def set_pose_by_homedock(context: Context, body: DockChoice | None = None) -> None:
    """Set the robot's pose to the front of a dock, by default its own; 404 if there is none."""
    if body is None:
        dock = home_dock(context.robot)
    else:
        docks = (dock for floor in _here(context) for dock in floor.annotations.docks)
        dock = next((dock for dock in docks if dock.id == body.dock_id), None)
    if dock is None:
        raise NotFound("no such dock on this floor of the loaded map")
    context.robot[Localization].set_pose(before(dock))


def _find_dock(context: Context, id: str) -> tuple[FloorMap, PointOfInterest] | None:
    docks = ((floor, dock) for floor in context.maps.floors for dock in floor.annotations.docks)
    return next((found for found in docks if found[1].id == id), None)
