"""Chapter "multi-floor": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.clients.slamware.values import ElevatorInfo
from roboglot.wire.slamware.chapters.motion import PathPoints
from roboglot.wire.slamware.chapters.multi_floor import (
    BoundDock,
    CurrentFloorInfo,
    DockChoice,
    DockInfo,
    FloorChoice,
    FloorInfo,
    MultiFloorStatus,
    NearbyPoi,
    PoiChoice,
    PoiInfo,
    PoseRelation,
    Reload,
    TrackQuery,
    Unbinding,
)
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap


class MultiFloor(Chapter):
    """Chapter "multi-floor"."""

    @call("GET /api/multi-floor/status")
    async def get_status(self) -> MultiFloorStatus:
        """Return the state of the map on disk; no cloud manages this robot."""

    @call("GET /api/multi-floor/map/v1/floors")
    async def get_floors(self) -> list[FloorInfo]:
        """The floors of the loaded map; none while nothing was loaded."""

    @call("GET /api/multi-floor/map/v1/floors/:current")
    async def get_current_floor(self) -> CurrentFloorInfo:
        """The floor whose map is in memory, and the elevator that the robot is in."""

    @call("PUT /api/multi-floor/map/v1/floors/:current")
    async def set_current_floor(self, body: FloorChoice) -> None:
        """Switch to the map of the floor that the robot was carried to. 404 if it is not loaded."""

    @call("GET /api/multi-floor/map/v1/pois")
    async def get_all_pois(self, floor: str | None = None, building: str | None = None) -> list[PoiInfo]:
        """The places of the loaded map, of one floor or of all; new ones are here after a sync."""

    @call("POST /api/multi-floor/map/v1/pois/:search_nearby")
    async def search_nearby_poi(self) -> NearbyPoi:
        """The nearest place on this floor as seen from the robot; ON_DOCK, IN_ELEVATOR, or UNKNOWN if there is none."""

    @call("POST /api/multi-floor/map/v1/pois/:dispatch")
    async def dispatch_by_pois(self, body: list[str]) -> list[str]:
        """The names in the order of the shortest round trip from here, by the ways that the robot would drive."""

    @call("GET /api/multi-floor/map/v1/homedocks")
    async def get_mutil_floor_home_docks(self, floor: str | None = None, building: str | None = None) -> list[DockInfo]:
        """The docks of the loaded map, of one floor or of all."""

    @call("GET /api/multi-floor/map/v1/homedocks/:current")
    async def get_current_home_dock(self) -> BoundDock:
        """The dock that the robot is bound to."""

    @call("PUT /api/multi-floor/map/v1/homedocks/:current")
    async def set_current_home_dock(self, body: DockChoice) -> None:
        """Go home to this dock from now on. If it is on another floor, the robot stands on it: its map is used."""

    @call("POST /api/multi-floor/map/v1/homedocks/:search_nearby")
    async def search_nearby_home_dock(self) -> DockInfo:
        """The nearest dock on this floor, in a straight line; 404 if there is none."""

    @call("POST /api/multi-floor/map/v1/stcm")
    async def upload_map(self, body: CompositeMap) -> None:
        """Keep this composite map on disk; it is used from the next reload on. 400 if it is none."""

    @call("DELETE /api/multi-floor/map/v1/stcm")
    async def delete_map(self) -> None:
        """Forget the map on disk; the one in memory stays."""

    @call("POST /api/multi-floor/map/v1/stcm/:save")
    async def save_stcm(self) -> None:
        """The map in memory to disk; 403 if the one on disk has several floors."""

    @call("POST /api/multi-floor/map/v1/stcm/:reload")
    async def reload_stcm(self, body: Reload | None = None) -> None:
        """The map on disk to memory; without a pose the robot is on or before its dock. 404 if none is saved."""

    @call("POST /api/multi-floor/map/v1/stcm/:sync")
    async def sync_stcm(self) -> None:
        """Save and reload: places added since then are known to multi-floor operations. The robot stays where it is."""

    @call("POST /api/multi-floor/map/v1/scene/unbind")
    async def unbind_scene(self, body: Unbinding | None = None) -> None:
        """No cloud has the robot; the map on disk is deleted unless it is to be kept."""

    @call("POST /api/multi-floor/map/v1/search_path_points")
    async def search_path_points_in_graph(self, body: TrackQuery) -> PathPoints:
        """The shortest way along the tracks, which go from their start to their end only if ``with_direction``."""

    @call("PUT /api/multi-floor/localization/v1/pose")
    async def set_pose_by_poi(self, body: PoiChoice) -> bool:
        """The robot is at this place of the floor, by its name or id; 404 if there is none."""

    @call("PUT /api/multi-floor/localization/v1/homedock")
    async def set_pose_by_homedock(self, body: DockChoice | None = None) -> None:
        """The robot is in front of this dock, or of its own; 404 if there is none."""

    @call("GET /api/multi-floor/map/v1/elevators")
    async def get_elevators(self) -> list[ElevatorInfo]:
        """The elevators of this floor and where to wait for them."""

    @call("GET /api/multi-floor/map/v1/elevators/{elevator_id}")
    async def get_elevators_by_id(self, elevator_id: str) -> ElevatorInfo:
        """Return one elevator; 400 if unknown."""

    @call("GET /api/multi-floor/map/v1/elevators/{elevator_id}/pose_relation")
    async def get_pose_relation_to_elevator(self, elevator_id: str) -> PoseRelation:
        """Return whether the robot is inside, on the sill or outside; 400 without an elevator."""
