"""Chapter "multi-floor": floors, their places and docks, the state of the map."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import msgspec

from roboglot.wire.slamware.geometry import Point, Pose2D, Pose3D

FloorText = Annotated[str, msgspec.Meta(max_length=64)]


class MapLoadStatus(StrEnum):
    """State of the map on disk."""

    NOT_LOADED = "NOT_LOADED"
    LOADING = "LOADING"
    LOADED = "LOADED"
    ERROR = "ERROR"


class MultiFloorStatus(msgspec.Struct):
    """Mapping switch, state of the map on disk, and its manager."""

    is_in_mapping_mode: bool
    map_load_status: MapLoadStatus
    is_managed_by_cloud: bool


class FloorInfo(msgspec.Struct):
    """One floor of the loaded map."""

    building: str
    floor: str
    order: int
    is_default_floor: bool


class CurrentFloorInfo(msgspec.Struct):
    """Location of the robot; ``elevator`` is empty outside of one."""

    building: str
    floor: str
    elevator: str
    map_id: str


class FloorChoice(msgspec.Struct):
    """Floor that the robot was carried to."""

    floor: FloorText
    building: FloorText = ""
    pose: Pose2D | None = None


class PoiInfo(msgspec.Struct, omit_defaults=True):
    """A place of the loaded map."""

    id: str
    poi_name: str
    floor: str
    building: str
    pose: Pose2D
    type: str = ""


class DockInfo(msgspec.Struct):
    """A dock of the loaded map."""

    id: str
    dock_name: str
    floor: str
    building: str
    pose: Pose2D


class NearbyPoi(msgspec.Struct, omit_defaults=True):
    """The nearest place, in the robot's frame; ``name`` may be ON_DOCK, IN_ELEVATOR or UNKNOWN."""

    name: str
    id: str = ""
    relative_pose: Point | None = None


class BoundDock(msgspec.Struct, omit_defaults=True):
    """The dock that the robot goes home to; ``result`` false: none is bound."""

    result: bool
    msg: str
    data: DockInfo | None = None


class PoiChoice(msgspec.Struct):
    """A place by its name."""

    poi_name: Annotated[str, msgspec.Meta(min_length=1, max_length=4096)]


class DockChoice(msgspec.Struct):
    """A dock by its id."""

    dock_id: Annotated[str, msgspec.Meta(min_length=1, max_length=64)]


class Reload(msgspec.Struct):
    """Pose in the map."""

    pose: Pose3D | None = None


class Unbinding(msgspec.Struct):
    """Unbinding from the cloud; ``keep_local_map``: keep the map on disk."""

    keep_local_map: bool = False


class TrackQuery(msgspec.Struct):
    """Path query from the robot and on this floor unless others are given."""

    end_point: Point
    start_point: Point | None = None
    building: FloorText = ""
    floor: FloorText = ""
    with_direction: bool = False


class PoseRelation(StrEnum):
    """Location of the robot."""

    IN = "in_elevator"
    AT_SILL = "close_to_elevator_sill"
    OUT = "out_of_elevator"
