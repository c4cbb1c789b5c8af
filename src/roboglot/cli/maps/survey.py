"""A composite map of all floors of a world, from its plan: walls and furniture as seen by a lidar, docks, lift."""

from __future__ import annotations

import math
import uuid

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import RESOLUTION
from roboglot.model.components.mapping.annotations import Annotations, Area, AreaKind
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid, PointOfInterest
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, FloorName, composite_of
from roboglot.simulation.building.blueprint import Solid, solids_of
from roboglot.simulation.world.description import Floor, Lift, WorldDescription
from roboglot.simulation.world.placing import Places, docks_of
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, Layer, encode_stcm

MARGIN = 0.5  # m around a floor
LIDAR = 0.2  # m above the floor
SURFACE = 0.075  # m of a solid that a lidar marks; the rest of it is unknown
FREE, OCCUPIED, UNKNOWN = -100, 100, 0
RADIUS = 0.25  # m: a medium-sized robot on its dock
LANDING = 1.2  # m from the car's door to the waiting place
BODY_GAP = 0.3  # m of a lift's sill


def surveyed(world: WorldDescription) -> bytes:
    """Return the map, in the world's frame. Raises BadMap."""
    docks = docks_of(world)
    layers: list[Layer] = []
    for number, floor in enumerate(world.floors):
        name = FloorName(world.name, floor.name or f"{number + 1}F", number, default=number == 0)
        homes = tuple(_mark(name, f"dock {n + 1}", dock.compose(Pose(RADIUS))) for n, dock in enumerate(docks[number]))
        notes = Annotations(docks=homes)
        places: tuple[PointOfInterest, ...] = ()
        if world.lift is not None:
            notes = notes.with_new(_elevator(world, world.lift))
            car = _car(world.lift)
            front = car.compose(Pose(world.lift.size[0] / 2 + LANDING, 0.0, 0.0))
            places = (_mark(name, f"{name.floor} lift", front),)
        layers += composite_of(FloorMap(name, _grid(floor, world.lift), notes, places)).layers
    return encode_stcm(CompositeMap(tuple(layers)))


def first_pose(world: WorldDescription, radius: float) -> Pose:
    """Return the start pose of the first robot of a world."""
    pose, _ = Places(world).next(None, 0, radius)
    return pose


def _grid(floor: Floor, lift: Lift | None) -> OccupancyGrid:
    (left, bottom), (width, depth) = floor.origin, floor.size
    columns, rows = (math.ceil((extent + 2 * MARGIN) / RESOLUTION) for extent in (width, depth))
    origin = Point(left - MARGIN, bottom - MARGIN)
    x = origin.x + (np.arange(columns) + 0.5) * RESOLUTION
    y = origin.y + (np.arange(rows)[:, None] + 0.5) * RESOLUTION
    inside = (x > left) & (x < left + width) & (y > bottom) & (y < bottom + depth)
    cells = np.where(inside, FREE, UNKNOWN).astype(np.int8)
    near = [
        (cells[window], _depth(solid, x[window[1]], y[window[0]]))
        for solid in solids_of(floor, lift, lift_here=True)
        if solid.base <= LIDAR < solid.base + solid.size[2]
        for window in [_around(solid, x, y)]
    ]
    for part, deep in near:
        part[deep >= SURFACE] = UNKNOWN
    for part, deep in near:  # surfaces take precedence over hidden space
        part[(deep >= -RESOLUTION / 2) & (deep < SURFACE)] = OCCUPIED
    return OccupancyGrid(cells, RESOLUTION, origin)


def _around(solid: Solid, x: NDArray[np.floating], y: NDArray[np.floating]) -> tuple[slice, slice]:
    """Return the rows and columns that a solid may cover in every orientation, with a margin of one cell."""
    reach = math.hypot(solid.size[0], solid.size[1]) / 2 + RESOLUTION
    (top, bottom), (left, right) = (
        np.searchsorted(axis, (middle - reach, middle + reach))
        for axis, middle in ((y[:, 0], solid.pose.y), (x, solid.pose.x))
    )
    return slice(top, bottom), slice(left, right)


def _depth(solid: Solid, x: NDArray[np.floating], y: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the depth (m) of each cell below a solid's surface; negative outside."""
    dx, dy = x - solid.pose.x, y - solid.pose.y
    if solid.round:
        return np.asarray(solid.size[0] / 2 - np.hypot(dx, dy))
    c, s = math.cos(solid.pose.yaw), math.sin(solid.pose.yaw)
    along, across = np.abs(c * dx + s * dy), np.abs(c * dy - s * dx)
    return np.asarray(np.minimum(solid.size[0] / 2 - along, solid.size[1] / 2 - across))


def _car(lift: Lift) -> Pose:
    return Pose(*lift.at, math.radians(lift.facing))


def _elevator(world: WorldDescription, lift: Lift) -> Area:
    """Return the area of the lift's car, from door to back, with the same id on every floor."""
    car, half = _car(lift), lift.size[0] / 2
    metadata = {
        "elevator_id": str(uuid.uuid5(uuid.NAMESPACE_OID, f"{world.name}/lift")),
        "elevator_sill_width": str(BODY_GAP),
        "elevator_scheduling_point_dist": "0.9",
        "elevator_door_type": "0",
    }
    ends = car.compose(Pose(half)).point, car.compose(Pose(-half)).point
    return Area(0, AreaKind.ELEVATOR, *ends, lift.size[1] / 2, metadata=metadata)


def _mark(floor: FloorName, name: str, pose: Pose) -> PointOfInterest:
    id = str(uuid.uuid5(uuid.NAMESPACE_OID, f"{floor.building}/{floor.floor}/{name}"))
    return PointOfInterest(id, pose, {"display_name": name})
